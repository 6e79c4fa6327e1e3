#include "experiments/page/page.h"

#include <gtest/gtest.h>
#include <openssl/evp.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "experiments/cases/cases.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/rows.h"
#include "experiments/harness/sha256.h"
#include "experiments/page/page_data.h"
#include "experiments/page/page_figures.h"

namespace hermesh {
namespace {

constexpr const char* kHostile = "</script><img src=x onerror=alert(1)><!-- \u2028 & \" '";

/// A row by hand: voxel size 0.5, distances in world units.
Json row_of(const std::string& run, const std::string& label, double triangles, double rms,
            const std::vector<double>& seconds = {0.3, 0.1, 0.2}) {
  std::vector<double> sorted = seconds;
  std::ranges::sort(sorted);
  return {{"experiment", "toy"},
          {"tier", "quick"},
          {"question", "why?"},
          {"run", run},
          {"date", "2026-01-0" + run + "T00:00:00Z"},
          {"commit", run + "23456789abcdef"},
          {"columns", {"triangles", "seconds", "to_rms"}},
          {"case", {{"name", "ball"}, {"origin", "generated"}, {"sha256", "abcdef"}}},
          {"resolution", 40},
          {"voxel_size", 0.5},
          {"variant", {{"name", label}, {"label", label}, {"options", ""}}},
          {"voxelization", {{"label", "openvdb"}, {"active_voxels", 1000}}},
          {"triangle_count", triangles},
          {"report", {{"to_reference", {{"rms", rms}}}}},
          {"seconds", {{"median", sorted[sorted.size() / 2]}, {"all", seconds}}}};
}

std::vector<Json> numbered(std::vector<Json> rows) {
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i][kPageRow] = i;
  return rows;
}

std::vector<Json> titled(const Json& figures, const std::string& start) {
  std::vector<Json> found;
  for (const Json& figure : figures)
    if (figure["title"].get<std::string>().starts_with(start)) found.push_back(figure);
  return found;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t number = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++number;
  return number;
}

std::string between(const std::string& text, const std::string& start, const std::string& end) {
  const std::size_t from = text.find(start);
  if (from == std::string::npos) return "";
  return text.substr(from + start.size(), text.find(end, from + start.size()) - from - start.size());
}

std::string base64(const std::vector<unsigned char>& bytes) {
  std::vector<unsigned char> text(bytes.size() * 4 / 3 + 5);
  return {reinterpret_cast<const char*>(text.data()),
          std::size_t(EVP_EncodeBlock(text.data(), bytes.data(), int(bytes.size())))};
}

TEST(Page, HostileTextsAreDataAndParseBack) {
  Json row = row_of("1", kHostile, 10, 0.1);
  row["question"] = row["failed"] = row["case"]["name"] = row["case"]["origin"] = kHostile;
  row["broken"] = {kHostile};
  row[kHostile] = "a key";
  const std::string page = html_page(kHostile, {row}, {{{{"name", kHostile}, {"points", 0}}, "AAAA"}});
  EXPECT_EQ(count(page, "<img"), 0u);
  EXPECT_EQ(count(page, "<script"), 3u);  // the data, a mesh, the script
  EXPECT_EQ(count(page, "</script>"), 3u);
  EXPECT_EQ(between(page, "<title>", "</title>"),
            "&lt;/script&gt;&lt;img src=x onerror=alert(1)&gt;&lt;!-- \u2028 &amp; &quot; '");
  const Json data = Json::parse(between(page, "<script type=\"application/json\" id=\"data\">", "</script>"));
  EXPECT_EQ(data["rows"], Json::array({row}));
  EXPECT_EQ(data["meshes"][0]["name"], kHostile);
  EXPECT_EQ(data["tables"][0]["rows"][0]["trouble"].size(), 2u);
  EXPECT_EQ(between(page, "id=\"mesh-0\">", "</script>"), "AAAA");
}

TEST(Page, AsksForNothingAndRunsItsOwnScriptAlone) {
  const std::string page = html_page("toy", {row_of("1", "a", 10, 0.1)}, {});
  const std::string policy = between(page, "http-equiv=\"Content-Security-Policy\" content=\"", "\"");
  EXPECT_TRUE(policy.starts_with("default-src 'none'; ")) << policy;
  EXPECT_EQ(policy.find("http"), std::string::npos);
  EXPECT_EQ(policy.find("unsafe"), std::string::npos);
  // The hash in the policy is that of the script as it stands in the page.
  const std::string hex = sha256_of_text(between(page, "</script>\n<script>", "</script>"));
  std::vector<unsigned char> digest;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    digest.push_back(static_cast<unsigned char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  EXPECT_NE(policy.find("script-src 'sha256-" + base64(digest) + "'"), std::string::npos) << policy;
  for (const char* source : {" src=", "@import", "url(", "fetch(", "XMLHttpRequest", "innerHTML",
                             "insertAdjacentHTML", "document.write"})
    EXPECT_EQ(count(page, source), 0u) << source;
}

TEST(Page, PartsThatLookLikePlacesOfTheTemplateStayAsTheyAre) {
  const std::string page = html_page("@DATA@", {row_of("1", "@SCRIPT@", 10, 0.1)}, {});
  EXPECT_EQ(between(page, "<title>", "</title>"), "@DATA@");
  EXPECT_EQ(count(page, "id=\"data\""), 1u);
  EXPECT_GE(count(page, "\"@SCRIPT@\""), 1u);
}

TEST(PageData, TablesHaveTheTextsOfTheReportAndNumbersInFull) {
  Json bad = row_of("1", "bad", 20, 0.25);
  bad["broken"] = {"closed (5 boundary edges)"};
  bad.erase("seconds");
  const Json data = page_data({row_of("1", "a", 1234567, 0.125), bad});
  ASSERT_EQ(data["tables"].size(), 1u);
  const Json& table = data["tables"][0];
  EXPECT_EQ(table["title"], "ball at resolution 40");
  EXPECT_EQ(table["columns"][0]["meaning"], "triangles, a quad counting as two");
  EXPECT_EQ(table["rows"][0]["cells"],
            Json::parse(R"([["1,234,567", 1234567.0], ["0.2", 0.2], ["0.25", 0.25]])"));
  EXPECT_EQ(table["rows"][1]["cells"][1], nullptr);
  EXPECT_EQ(table["rows"][0]["trouble"], Json::array());
  EXPECT_EQ(table["rows"][1]["trouble"],
            Json::array({"BROKEN: bad on ball at resolution 40: closed (5 boundary edges)"}));
}

TEST(PageData, HistoriesAreOfCellsWithSeveralRuns) {
  const Json data =
      page_data({row_of("2", "a", 10, 0.1), row_of("2", "once", 10, 0.1), row_of("1", "a", 30, 0.1)});
  EXPECT_EQ(data["rows"].size(), 3u);
  ASSERT_EQ(data["histories"].size(), 1u);
  const Json& history = data["histories"][0];
  ASSERT_EQ(history["runs"].size(), 2u);
  EXPECT_EQ(history["runs"][0]["run"], "1");  // by date, though it stands last
  ASSERT_EQ(history["series"].size(), 1u);
  EXPECT_EQ(history["series"][0]["label"], "a");
  const Json& points = history["series"][0]["points"];
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0]["row"], 2);
  EXPECT_EQ(points[0]["cells"][0], 30.0);
  EXPECT_EQ(points[1]["run"], 1);
  EXPECT_EQ(points[1]["cells"][0], 10.0);
  EXPECT_TRUE(page_data({row_of("1", "a", 1, 0.1), row_of("1", "b", 1, 0.1)})["histories"].empty());
}

TEST(PageFigures, ExtractionsHaveTheirErrorsAndTheirTimes) {
  const Json figures = figures_of(numbered({row_of("1", "a", 100, 0.25), row_of("1", "b", 50, 0.5, {0.4})}));
  const auto errors = titled(figures, "Triangles and distance"), times = titled(figures, "Time, ");
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_TRUE(errors[0]["log_x"] && errors[0]["log_y"] && errors[0]["front"]);
  EXPECT_EQ(errors[0]["series"][0]["points"], Json::parse("[[0, 100.0, 0.5, null, null]]"));
  EXPECT_EQ(errors[0]["series"][1]["points"], Json::parse("[[1, 50.0, 1.0, null, null]]"));
  ASSERT_EQ(times.size(), 1u);
  EXPECT_EQ(times[0]["series"][0]["points"], Json::parse("[[0, 0.2, 0.0, 0.1, 0.3]]"));
  EXPECT_EQ(times[0]["series"][1]["points"], Json::parse("[[1, 0.4, 0.0, null, null]]"));
  EXPECT_EQ(times[0]["series"][1]["style"], errors[0]["series"][1]["style"]);
  EXPECT_TRUE(titled(figures, "Time and size").empty());
}

TEST(PageFigures, SeveralResolutionsHaveTimeOverSize) {
  Json large = row_of("1", "a", 400, 0.1, {2.0});
  large["resolution"] = 80;
  large["voxelization"]["active_voxels"] = 4000;
  const auto scaling = titled(figures_of(numbered({large, row_of("1", "a", 100, 0.2)})), "Time and size");
  ASSERT_EQ(scaling.size(), 1u);
  EXPECT_EQ(scaling[0]["x_label"], "active voxels");
  EXPECT_EQ(scaling[0]["series"][0]["points"],
            Json::parse("[[1, 1000.0, 0.2, 0.1, 0.3], [0, 4000.0, 2.0, null, null]]"));
}

TEST(PageFigures, PlotsOfTheRowsTakeThePlaceOfThoseOfTheirKind) {
  Json row = row_of("1", "a", 100, 0.25);
  row["plots"] = {to_json(Plot{
      .name = "p", .title = "asked for", .x = "triangles", .y = {"to_rms"}, .x_label = "x", .y_label = "y"})};
  const Json figures = figures_of(numbered({row_of("1", "b", 50, 0.5), row}));
  ASSERT_EQ(titled(figures, "asked for").size(), 1u);
  EXPECT_EQ(titled(figures, "asked for")[0]["series"][1]["points"],
            Json::parse("[[1, 100.0, 0.5, null, null]]"));
  EXPECT_TRUE(titled(figures, "Triangles and distance").empty());
}

TEST(PageFigures, MeasurementsShowSlopesWithTheirIntervals) {
  Json row = {{"experiment", "scaling"},
              {"tier", "quick"},
              {"run", "1"},
              {"kind", "measurement"},
              {"measurement", {{"name", "m"}}},
              {"case", {{"name", "extraction"}}},
              {"variant", {{"name", "a"}, {"label", "a"}}},
              {"table", {{"title", "t"}, {"columns", Json::array()}}},
              {"values", {{"order", 1.9}, {"order_low", 1.7}, {"order_high", 2.1}, {"size", 7}}}};
  for (const char* name : {"order", "order_low", "order_high", "size"})
    row["table"]["columns"].push_back({{"name", name}, {"header", name}, {"meaning", name}});
  const Json figures = figures_of(numbered({row}));
  ASSERT_EQ(figures.size(), 1u);
  EXPECT_EQ(figures[0]["kind"], "dots");
  EXPECT_EQ(figures[0]["series"][0]["points"], Json::parse("[[0, 1.9, 0.0, 1.7, 2.1]]"));
}

/// What the page's script does with a packed mesh.
struct Unpacked {
  std::vector<std::int64_t> steps, corners;
  std::vector<double> distances;

  explicit Unpacked(const PageMesh& mesh) {
    std::vector<unsigned char> packed(mesh.packed.size());
    int length = EVP_DecodeBlock(packed.data(), reinterpret_cast<const unsigned char*>(mesh.packed.data()),
                                 int(mesh.packed.size()));
    length -= int(std::ranges::count(mesh.packed, '='));
    uLongf size = 1 << 20;
    bytes_.resize(size);
    if (uncompress(bytes_.data(), &size, packed.data(), uLong(length)) != Z_OK)
      throw std::runtime_error("not deflated");
    bytes_.resize(size);
    const std::size_t points = mesh.head["points"];
    for (int axis = 0; axis < 3; ++axis) read(points, steps);
    read(3 * mesh.head["triangles"].get<std::size_t>() + 4 * mesh.head["quads"].get<std::size_t>(), corners);
    if (!mesh.head["largest"].is_null())
      for (std::size_t i = 0; i < points; ++i)
        distances.push_back((256 * bytes_.at(at_ + i) + bytes_.at(at_ + points + i)) / 65535.0 *
                            mesh.head["largest"].get<double>());
    if (at_ + 2 * distances.size() != size) throw std::runtime_error("bytes are left over");
  }

 private:
  void read(std::size_t number, std::vector<std::int64_t>& into) {
    std::int64_t before = 0;
    for (std::size_t i = 0; i < number; ++i) {
      std::uint64_t value = 0;
      int shift = 0;
      do value |= std::uint64_t(bytes_.at(at_) & 0x7f) << shift, shift += 7;
      while (bytes_.at(at_++) & 0x80);
      into.push_back(before += value & 1 ? -std::int64_t(value >> 1) - 1 : std::int64_t(value >> 1));
    }
  }
  std::vector<unsigned char> bytes_;
  std::size_t at_ = 0;
};

TEST(PackedMesh, HoldsPointsToHalfAStepAndCornersAndDistances) {
  MeshFile mesh;
  mesh.points = {{-1, 0, 3}, {1, 0.123456, 3}, {1, -7, 1000}, {0.5, 2, 3}};
  mesh.triangles = {{2, 1, 0}};
  mesh.quads = {{0, 1, 2, 3}};
  const PageMesh packed = pack_mesh(mesh, 0.5, {0.0, 0.25, 1.0, 0.125});
  EXPECT_EQ(packed.head["step"], 0.5 / 256);
  EXPECT_EQ(packed.head["largest"], 1.0);
  const Unpacked unpacked(packed);
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_NEAR(packed.head["lower"][axis].get<double>() + 0.5 / 256 * double(unpacked.steps[4 * axis + i]),
                  mesh.points[i][Eigen::Index(axis)], 0.25 / 256);
    EXPECT_NEAR(unpacked.distances[i], (std::vector{0.0, 0.25, 1.0, 0.125})[i], 1.0 / 65535);
  }
  EXPECT_EQ(unpacked.corners, (std::vector<std::int64_t>{2, 1, 0, 0, 1, 2, 3}));
  mesh.points[0][0] = std::nan("");
  EXPECT_THROW(pack_mesh(mesh, 0.5, {}), Error);
}

TEST(PackedMesh, ATinyVoxelDoesNotMakeStepsThatOverflow) {
  MeshFile mesh;
  mesh.points = {{0, 0, 0}, {1e6, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_EQ(Unpacked(pack_mesh(mesh, 1e-12, {})).steps[1], 1 << 22);
}

TEST(MeshChoices, AreAllNoneOrANumber) {
  EXPECT_TRUE(mesh_choice("all").all);
  EXPECT_EQ(mesh_choice("none").count, 0u);
  EXPECT_FALSE(mesh_choice("none").all);
  EXPECT_EQ(mesh_choice("3").count, 3u);
  for (const char* wrong : {"", "some", "-1", "3.5", "3 ", "99999999999999999999999"})
    EXPECT_THROW(mesh_choice(wrong), Error) << wrong;
}

class PageFolder : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_.parent_path()); }

  /// A square in the plane z.
  std::filesystem::path write_square(const std::filesystem::path& file, float z) {
    PolygonMesh mesh;
    mesh.points = {{0, 0, z}, {1, 0, z}, {1, 1, z}, {0, 1, z}};
    mesh.quads.push_back({0, 1, 2, 3});
    std::filesystem::create_directories(file.parent_path());
    write_mesh(file, mesh, context_);
    return file;
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("hermesh-page-" + std::to_string(getpid())) / "toy";
  RunContext context_;
};

TEST_F(PageFolder, MeshesHaveTheirRowsAndTheDistancesToTheInput) {
  const LoadedCase input = load_case(write_square(folder_ / "input.ply", 0).string(), context_);
  Json row = row_of("1", "a b", 2, 0.1);
  row["case"] = case_json(input);
  const std::filesystem::path meshes = folder_ / "meshes" / ("toy-" + file_name(input.name) + "-40");
  write_square(meshes / "1-a-b.ply", 0.25);
  write_square(meshes / "2-nobody.ply", 0.25);
  Json other = row_of("1", "changed", 2, 0.1);
  other["case"] = row["case"];
  other["case"]["sha256"] = "0123";
  write_square(meshes / "3-changed.ply", 0.25);
  const std::vector<PageMesh> found =
      page_meshes(folder_, {row_of("1", "a b", 2, 0.1), row, other}, {.all = true, .count = 0}, context_);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].head["row"], 1);
  EXPECT_EQ(found[0].head["largest"], 0.5);  // voxels
  for (const double distance : Unpacked(found[0]).distances) EXPECT_EQ(distance, 0.5);
  EXPECT_EQ(found[0].head["sentence"], "");
  EXPECT_EQ(found[1].head["row"], nullptr);
  EXPECT_EQ(found[1].head["sentence"], "no row is of this mesh");
  EXPECT_EQ(found[2].head["row"], 2);
  EXPECT_EQ(found[2].head["largest"], nullptr);
  EXPECT_NE(found[2].head["sentence"].get<std::string>().find("is not that of the row"), std::string::npos);

  EXPECT_EQ(page_meshes(folder_, {row}, {.all = false, .count = 2}, context_).size(), 2u);
  EXPECT_NE(context_.notes.back().find("1 of the 3 meshes"), std::string::npos) << context_.notes.back();
  EXPECT_TRUE(page_meshes(folder_, {row}, {.all = false, .count = 0}, context_).empty());
}

TEST_F(PageFolder, AMeshThatCannotBeReadIsNotedAndLeftOut) {
  std::filesystem::create_directories(folder_ / "meshes" / "toy-ball-40");
  std::ofstream(folder_ / "meshes" / "toy-ball-40" / "1-a.ply") << "no mesh";
  EXPECT_TRUE(page_meshes(folder_, {row_of("1", "a", 2, 0.1)}, {.all = true, .count = 0}, context_).empty());
  ASSERT_EQ(context_.notes.size(), 1u);
  EXPECT_TRUE(context_.notes[0].starts_with("toy-ball-40/1-a.ply is not in the page: ")) << context_.notes[0];
}

TEST_F(PageFolder, BaselinesBesideItAreEarlierRuns) {
  append_row(folder_ / "rows.jsonl", row_of("2", "a", 10, 0.1));
  const std::filesystem::path baselines = folder_.parent_path() / "baselines";
  std::filesystem::create_directories(baselines);
  Json other = row_of("1", "a", 10, 0.1);
  other["experiment"] = "another";
  for (const Json& row : {row_of("1", "a", 30, 0.1), other, row_of("2", "a", 10, 0.1)})
    append_row(baselines / "rows.jsonl", row);
  std::ostringstream said;
  write_page(folder_, {}, context_, said);
  EXPECT_NE(said.str().find("report.html (2 rows, 0 meshes"), std::string::npos) << said.str();
  std::ifstream stream(folder_ / "report.html");
  const std::string page(std::istreambuf_iterator<char>(stream), {});
  const Json data = Json::parse(between(page, "id=\"data\">", "</script>"));
  EXPECT_EQ(data["tables"][0]["rows"][0]["row"], 1);  // the folder's own run is the one that is shown
  EXPECT_EQ(data["tables"][0]["earlier"], 1);
  EXPECT_EQ(data["histories"].size(), 1u);
  // As results/baselines is for results/local/toy.
  const std::filesystem::path local = folder_.parent_path() / "local" / "toy";
  std::filesystem::create_directories(local);
  append_row(local / "rows.jsonl", row_of("3", "a", 10, 0.1));
  write_page(local, {}, context_, said);
  EXPECT_NE(said.str().find("report.html (3 rows, 0 meshes"), std::string::npos) << said.str();
}

}  // namespace
}  // namespace hermesh
