// hermesh list: extractors and voxelizers; the laboratory adds its experiments and cases.
#include <iostream>
#include <memory>

#include "experiments/cli/cli11.h"
#include "experiments/cli/laboratory.h"
#include "experiments/pipeline.h"
#include "experiments/variants.h"

namespace hermesh::cli {
namespace {

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

std::string with(const char* between, const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

std::string allowed(const OptionSpec& option) {
  if (option.choices.empty()) {
    // A bound this large declares none.
    const std::string upper = option.maximum >= 1e300 ? "" : " to " + text(option.maximum);
    return (upper.empty() ? "from " : "") + text(option.minimum) + upper;
  }
  return with("|", option.choices);
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

void print_text() {
  std::cout << "extractors (hermesh extract, remesh --extractor NAME)\n";
  for (const Extractor& extractor : all_extractors()) {
    print_name(extractor);
    const std::string guarantees = with(", ", promise_words(extractor.promises));
    print_line("", "guarantees: " + (guarantees.empty() ? "nothing" : guarantees));
    print_options("-o", extractor.options);
  }
  std::cout << "\nvoxelizers (hermesh voxelize, remesh --voxelizer NAME)\n";
  for (const Voxelizer& voxelizer : all_voxelizers()) {
    print_name(voxelizer);
    print_options("--voxelizer-option", voxelizer.options);
  }
  std::cout << laboratory_output({"list"}).value_or("");
}

}  // namespace

void add_list(CLI::App& app, Session& session) {
  CLI::App* command = add_command(app, session, "list", "List extractors, voxelizers, experiments and cases");
  auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "Print JSON");
  set_work(*command, session, [json] {
    *json ? print_json() : print_text();
    return kDone;
  });
}

}  // namespace hermesh::cli
