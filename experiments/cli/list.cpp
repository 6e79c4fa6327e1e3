// hermesh list: variants and voxelizers; the laboratory adds its experiments and cases.
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "experiments/cli/cli11.h"
#include "experiments/cli/format.h"
#include "experiments/cli/laboratory.h"
#include "experiments/cli/session.h"
#include "experiments/pipeline.h"
#include "experiments/variants.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::ordered_json;

void print_json() {
  Json all = {{"extractors", to_json(all_extractors())}, {"voxelizers", to_json(all_voxelizers())}};
  if (const auto output = laboratory_output({"list", "--json"})) all.update(Json::parse(*output));
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
    print_line(
        "", flag + " " + option.name + "=" + option.fallback + " (" + allowed(option) + "): " + option.help);
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
  std::cout << laboratory_output({"list"}).value_or("");
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
