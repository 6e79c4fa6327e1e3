// hermesh list: variants, voxelizers, experiments and cases.
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "algorithms/variants.h"
#include "experiments/cases/cases.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/format.h"
#include "experiments/cli/session.h"
#include "experiments/harness/harness.h"
#include "experiments/pipeline.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::ordered_json;

bool is_ours(const Extractor& extractor) {
  return std::ranges::find(our_extractors(), extractor.name, &Extractor::name) != our_extractors().end();
}
bool is_ours(const Voxelizer& voxelizer) {
  return std::ranges::find(our_voxelizers(), voxelizer.name, &Voxelizer::name) != our_voxelizers().end();
}

Json to_json(const OptionSpec& option) {
  Json json = {{"name", option.name}, {"default", option.fallback}, {"help", option.help}};
  if (option.choices.empty()) {
    json["minimum"] = option.minimum;
    json["maximum"] = option.maximum;
  } else {
    json["choices"] = option.choices;
  }
  return json;
}

Json to_json(const std::vector<OptionSpec>& options) {
  Json all = Json::array();
  for (const OptionSpec& option : options) all.push_back(to_json(option));
  return all;
}

Json to_json(const Extractor& extractor) {
  const Promises& promises = extractor.promises;
  return {{"name", extractor.name},
          {"summary", extractor.summary},
          {"ours", is_ours(extractor)},
          {"promises",
           {{"closed", promises.closed},
            {"manifold", promises.manifold},
            {"oriented", promises.oriented},
            {"no_self_intersection", promises.no_self_intersection}}},
          {"options", to_json(extractor.options)}};
}

void print_json() {
  Json all = {{"extractors", Json::array()},
              {"voxelizers", Json::array()},
              {"experiments", Json::array()},
              {"cases", Json::array()}};
  for (const Extractor& extractor : all_extractors()) all["extractors"].push_back(to_json(extractor));
  for (const Voxelizer& voxelizer : all_voxelizers())
    all["voxelizers"].push_back({{"name", voxelizer.name},
                                 {"summary", voxelizer.summary},
                                 {"ours", is_ours(voxelizer)},
                                 {"options", to_json(voxelizer.options)}});
  for (const ExperimentInfo& experiment : list_experiments())
    all["experiments"].push_back(
        {{"name", experiment.name}, {"question", experiment.question}, {"file", experiment.file.string()},
         {"shows", experiment.shows}});
  for (const CaseInfo& item : list_cases())
    all["cases"].push_back({{"name", item.name}, {"summary", item.summary}, {"kind", item.kind}});
  std::cout << all.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

void print_line(const std::string& name, const std::string& text) {
  constexpr std::size_t kNameWidth = 24;
  std::cout << "  " << name << std::string(name.size() < kNameWidth ? kNameWidth - name.size() : 1, ' ')
            << text << '\n';
}

std::string promised(const Promises& promises) {
  std::string text;
  for (const std::string& word : promise_words(promises)) text += (text.empty() ? "" : ", ") + word;
  return text.empty() ? "nothing" : text;
}

std::string allowed(const OptionSpec& option) {
  if (option.choices.empty()) {
    // A bound this large is the declaration's way to say that there is none.
    const std::string upper = option.maximum >= 1e300 ? "" : " to " + text(option.maximum);
    return (upper.empty() ? "from " : "") + text(option.minimum) + upper;
  }
  std::string names;
  for (const std::string& choice : option.choices) names += (names.empty() ? "" : "|") + choice;
  return names;
}

void print_options(const std::string& flag, const std::vector<OptionSpec>& options) {
  for (const OptionSpec& option : options)
    print_line("",
               flag + " " + option.name + "=" + option.fallback + " (" + allowed(option) + "): " + option.help);
}

template <class Variant>
void print_name(const Variant& variant) {
  print_line(variant.name, variant.summary + (is_ours(variant) ? "" : " [reference]"));
}

void print_extractor(const Extractor& extractor) {
  print_name(extractor);
  print_line("", "promises: " + promised(extractor.promises));
  print_options("-o", extractor.options);
}

void print_voxelizer(const Voxelizer& voxelizer) {
  print_name(voxelizer);
  print_options("--voxelizer-option", voxelizer.options);
}

void print_text() {
  std::cout << "extractors (hermesh extract, remesh --extractor NAME)\n";
  for (const Extractor& extractor : all_extractors()) print_extractor(extractor);
  std::cout << "\nvoxelizers (hermesh voxelize, remesh --voxelizer NAME)\n";
  for (const Voxelizer& voxelizer : all_voxelizers()) print_voxelizer(voxelizer);
  std::cout << "\nexperiments (hermesh run NAME), and the tables and figures of the thesis that they make\n";
  for (const ExperimentInfo& experiment : list_experiments()) {
    print_line(experiment.name, experiment.question);
    std::string numbers;
    for (const std::string& number : experiment.shows) numbers += (numbers.empty() ? "also called " : ", ") + number;
    if (!numbers.empty()) print_line("", numbers);
  }
  std::cout << "\ncases (inputs that experiments name)\n";
  for (const CaseInfo& item : list_cases()) print_line(item.name, item.summary + " [" + item.kind + "]");
}

}  // namespace

void add_list(CLI::App& app, Session& session) {
  CLI::App* command = add_command(app, session, "list", "Variants, voxelizers, experiments and cases");
  auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "Print JSON");
  command->callback([json, &session] {
    session.command = [json] {
      *json ? print_json() : print_text();
      return kDone;
    };
  });
}

}  // namespace hermesh::cli
