#include "experiments/page/page.h"

#include <openssl/evp.h>
#include <openssl/sha.h>

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>

#include "algorithms/core/error.h"
#include "experiments/harness/current_plots.h"
#include "experiments/harness/provenance.h"
#include "experiments/harness/rows.h"
#include "experiments/page/page_data.h"

namespace hermesh {
namespace {

std::string for_html(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += c == '<'   ? "&lt;"
              : c == '>' ? "&gt;"
              : c == '&' ? "&amp;"
              : c == '"' ? "&quot;"
                         : std::string(1, c);
  return result;
}

/// JSON that ends no element and opens no comment of HTML: `<` occurs in strings alone, where JSON has an
/// escape for it.
std::string for_script(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string result;
  result.reserve(text.size() + 64);
  for (const char c : text) c == '<' ? result += "\\u003c" : result += c;
  return result;
}

/// A source of the policy that allows this text and no other.
std::string hash_source(std::string_view text) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());
  std::array<unsigned char, 4 * ((SHA256_DIGEST_LENGTH + 2) / 3) + 1> encoded{};
  const int length = EVP_EncodeBlock(encoded.data(), digest.data(), int(digest.size()));
  return "'sha256-" + std::string(reinterpret_cast<const char*>(encoded.data()), std::size_t(length)) + "'";
}

/// The template with its parts in place of @NAME@. Parts are not searched again, so that what looks like a
/// name in them stays as it is.
std::string filled(std::string_view text,
                   const std::vector<std::pair<std::string_view, std::string_view>>& parts) {
  std::string result;
  while (!text.empty()) {
    std::size_t at = std::string_view::npos;
    const std::pair<std::string_view, std::string_view>* first = nullptr;
    for (const auto& part : parts)
      if (const std::size_t found = text.find(part.first); found < at) at = found, first = &part;
    result += text.substr(0, at);
    if (!first) break;
    result += first->second;
    text.remove_prefix(at + first->first.size());
  }
  return result;
}

/// Rows of the folders `baselines` beside the folder and above it, of experiments that the rows are of,
/// without those that the folder holds itself.
std::vector<Json> baseline_rows(const std::filesystem::path& folder, const std::vector<Json>& rows) {
  std::set<std::string> experiments, known;
  for (const Json& row : rows) {
    experiments.insert(text_at(row, "/experiment"));
    known.insert(row.dump());
  }
  std::vector<Json> result;
  for (const char* way : {"..", "../.."}) {
    const std::filesystem::path baselines =
        std::filesystem::absolute(folder / way).lexically_normal() / "baselines";
    // Of an empty folder read_rows() makes an error.
    if (!std::filesystem::is_directory(baselines) || std::filesystem::is_empty(baselines)) continue;
    for (Json& row : read_rows(baselines))
      if (experiments.contains(text_at(row, "/experiment")) && known.insert(row.dump()).second)
        result.push_back(std::move(row));
  }
  return result;
}

}  // namespace

std::string html_page(const std::string& title, const std::vector<Json>& rows,
                      const std::vector<PageMesh>& meshes) {
  Json data = page_data(rows);
  data["made_by"] = source_state().commit;
  data["meshes"] = Json::array();
  std::string blocks;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    data["meshes"].push_back(meshes[i].head);
    blocks += "<script type=\"application/octet-stream\" id=\"mesh-" + std::to_string(i) + "\">" +
              meshes[i].packed + "</script>\n";
  }
  const std::string policy = "default-src 'none'; script-src " + hash_source(kPageScript) + "; style-src " +
                             hash_source(kPageStyle) + "; img-src data:; base-uri 'none'; form-action 'none'";
  return filled(kPageHtml, {{"@TITLE@", for_html(title)},
                            {"@POLICY@", policy},
                            {"@STYLE@", kPageStyle},
                            {"@DATA@", for_script(data)},
                            {"@MESHES@", blocks},
                            {"@SCRIPT@", kPageScript}});
}

void write_page(const std::filesystem::path& folder, const MeshChoice& choice, RunContext& context,
                std::ostream& out) {
  std::vector<Json> rows = read_rows(folder);
  const std::filesystem::path place =
      std::filesystem::is_directory(folder) ? folder : std::filesystem::absolute(folder).parent_path();
  std::vector<Json> before = baseline_rows(place, rows);
  // Earlier runs come first, since of a table's runs the last one is shown.
  rows.insert(rows.begin(), std::make_move_iterator(before.begin()), std::make_move_iterator(before.end()));
  rows = with_current_plots(std::move(rows), place);
  const std::vector<PageMesh> meshes = page_meshes(place, rows, choice, context);
  std::string name = std::filesystem::absolute(place).lexically_normal().filename().string();
  if (name.empty())
    name = std::filesystem::absolute(place).lexically_normal().parent_path().filename().string();
  const std::string page = html_page("hermesh: " + name, rows, meshes);
  const std::filesystem::path file = place / "report.html";
  std::ofstream stream(file, std::ios::binary);
  stream << page;
  if (!stream.flush()) throw Error("cannot write " + file.string());
  for (const std::string& note : context.notes) out << "Note: " << note << '\n';
  out << "Page: " << file.string() << " (" << rows.size() << " rows, " << meshes.size() << " meshes, "
      << readable(static_cast<double>(page.size()) / (1 << 20)) << " MiB)\n";
}

}  // namespace hermesh
