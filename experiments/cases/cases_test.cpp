#include "experiments/cases/cases.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <set>
#include <tuple>

#include "algorithms/io/mesh_file.h"
#include "experiments/cases/recipes.h"

namespace hermesh {
namespace cases_test {

namespace fs = std::filesystem;

/// True if every edge has exactly one triangle on each side, with the same orientation.
bool closed_and_oriented(const PolygonMesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& [a, b, c] : triangulated(mesh)) edges.insert(edges.end(), {{a, b}, {b, c}, {c, a}});
  std::ranges::sort(edges);
  if (std::ranges::adjacent_find(edges) != edges.end()) return false;
  return std::ranges::all_of(edges, [&](const auto& edge) {
    return std::ranges::binary_search(edges, std::pair(edge.second, edge.first));
  });
}

double volume(const PolygonMesh& mesh) {
  double sixfold = 0.0;
  for (const auto& [a, b, c] : triangulated(mesh))
    sixfold += mesh.world(a).dot(mesh.world(b).cross(mesh.world(c)));
  return sixfold / 6.0;
}

double smallest_area(const PolygonMesh& mesh) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const auto& [a, b, c] : triangulated(mesh))
    smallest =
        std::min(smallest, (mesh.world(b) - mesh.world(a)).cross(mesh.world(c) - mesh.world(a)).norm() / 2.0);
  return smallest;
}

long euler_characteristic(const PolygonMesh& mesh) {  // of a closed mesh of triangles
  return static_cast<long>(mesh.points.size()) - static_cast<long>(mesh.triangles.size()) / 2;
}

PolygonMesh make(const std::string& name, const RecipeParameters& parameters = {}) {
  RunContext context;
  return make_recipe(name, parameters, context);
}

template <class Call>
std::string error_in(Call call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

const double pi = std::acos(-1.0);

TEST(Recipes, AreClosedOrientedAndWithoutDegenerateTriangles) {
  for (const std::string& recipe : recipe_names()) {
    RecipeParameters parameters;
    if (recipe == "noise-sphere" || recipe == "cad-part") parameters["triangles"] = 5000;
    const PolygonMesh mesh = make(recipe, parameters);
    EXPECT_TRUE(closed_and_oriented(mesh)) << recipe;
    EXPECT_GT(volume(mesh), 0.0) << recipe;
    EXPECT_GT(smallest_area(mesh), 1e-9) << recipe;
  }
}

TEST(Recipes, HaveTheVolumesOfTheirFormulas) {
  EXPECT_NEAR(volume(make("turned-cube", {{"side", 2.0}})), 8.0, 1e-12);
  EXPECT_NEAR(volume(make("turned-cube", {{"about_x", 20}, {"about_y", 30}, {"about_z", 40}})), 1.0, 1e-6);
  EXPECT_NEAR(volume(make("torus", {{"around", 256}, {"across", 256}})), 2 * pi * pi * 0.16, 2e-3);
  EXPECT_NEAR(volume(make("cylinder", {{"around", 2000}, {"height", 3}})), 3 * pi, 1e-4);
  EXPECT_NEAR(volume(make("uv-sphere", {{"around", 512}, {"upward", 256}, {"radius", 2}})), 32 * pi / 3,
              1e-2);
  EXPECT_NEAR(volume(make("noise-sphere", {{"triangles", 5e4}, {"octaves", 0}})), 4 * pi / 3, 1e-3);
  EXPECT_NEAR(volume(make("nested-spheres", {{"cuts", 64}})), 4 * pi / 3 * (1 - 0.343 + 0.064), 3e-3);
  EXPECT_NEAR(volume(make("overlapping-spheres", {{"cuts", 64}})), 8 * pi / 3, 4e-3);
}

TEST(Recipes, HaveTheGenusOfTheirShapes) {
  EXPECT_EQ(euler_characteristic(make("noise-sphere", {{"triangles", 2000}})), 2);
  EXPECT_EQ(euler_characteristic(make("torus")), 0);
  EXPECT_EQ(euler_characteristic(make("cad-part", {{"triangles", 2000}})), 2);
  EXPECT_EQ(euler_characteristic(make("nested-spheres")), 6);
}

TEST(Recipes, ClusterMayBeDoubledAndTurned) {
  const PolygonMesh once = make("sphere-cluster", {{"cuts", 8}});
  EXPECT_EQ(once.triangle_count(), 8u * 8 * 64);
  EXPECT_NEAR(volume(once), 8 * 4 * pi / 3, 1.0);  // flat triangles lack a little
  const PolygonMesh shuffled = make("sphere-cluster", {{"cuts", 8}, {"copies", 2}, {"turned", 1}});
  EXPECT_EQ(shuffled.points, once.points);
  EXPECT_EQ(shuffled.triangle_count(), 2 * once.triangle_count());
  EXPECT_LT(std::abs(volume(shuffled)), 0.2 * volume(once));
}

TEST(Recipes, HoleHasItsDiameter) {
  const RecipeParameters parameters = {{"radius", 40}, {"hole", 2}};
  RecipeParameters open_parameters = parameters;
  open_parameters["open"] = 1;
  const PolygonMesh closed = make("holed-sphere", parameters), open = make("holed-sphere", open_parameters);
  EXPECT_NEAR(volume(closed), 4 * pi / 3 * 64000, 600);
  EXPECT_FALSE(closed_and_oriented(open));
  ASSERT_EQ(closed.triangle_count(), open.triangle_count() + 128);
  // The last ring, before the pole that the open one lacks.
  const Eigen::Vector3d pole = closed.world(closed.points.size() - 1).normalized();
  for (std::size_t i = open.points.size() - 128; i < open.points.size(); ++i)
    EXPECT_NEAR(open.world(i).cross(pole).norm(), 1.0, 1e-4);
}

TEST(Recipes, SheetsAreApart) {
  const PolygonMesh mesh = make("sheets", {{"plates", 3}, {"width", 4}, {"thickness", 0.5}, {"gap", 0.25}});
  EXPECT_NEAR(volume(mesh), 3 * 4 * 4 * 0.5, 1e-5);
  EXPECT_NEAR(bounds(mesh).size().z(), 3 * 0.5 + 2 * 0.25, 1e-6);
}

TEST(Recipes, TurnTheCubeAboutXThenYThenZ) {
  const PolygonMesh cube = make("turned-cube", {{"about_x", 20}, {"about_y", 30}, {"about_z", 40}});
  const auto turn = [](double degrees, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(degrees * pi / 180.0, axis).toRotationMatrix();
  };
  const Eigen::Matrix3d matrix = turn(40, Eigen::Vector3d::UnitZ()) * turn(30, Eigen::Vector3d::UnitY()) *
                                 turn(20, Eigen::Vector3d::UnitX());
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d expected = matrix * (Eigen::Vector3d(corner & 1, corner >> 1 & 1, corner >> 2 & 1) -
                                               Eigen::Vector3d::Constant(0.5));
    EXPECT_LT((cube.world(static_cast<std::size_t>(corner)) - expected).norm(), 1e-7);
  }
}

TEST(Recipes, MeetTheirNumberOfTriangles) {
  for (const double triangles : {20000.0, 69451.0}) {
    EXPECT_NEAR(static_cast<double>(
                    make("noise-sphere", {{"triangles", triangles}, {"octaves", 0}}).triangle_count()),
                triangles, 0.01 * triangles);
    EXPECT_NEAR(static_cast<double>(make("cad-part", {{"triangles", triangles}}).triangle_count()), triangles,
                0.03 * triangles);
  }
}

TEST(Recipes, NoiseHasTheStatedHeightAndDependsOnTheSeed) {
  const PolygonMesh one = make("noise-sphere", {{"triangles", 20000}, {"seed", 1}});
  const PolygonMesh two = make("noise-sphere", {{"triangles", 20000}, {"seed", 2}});
  double lowest = 10.0, highest = 0.0, difference = 0.0;
  for (std::size_t i = 0; i < one.points.size(); ++i) {
    lowest = std::min(lowest, one.world(i).norm());
    highest = std::max(highest, one.world(i).norm());
    difference = std::max(difference, (one.world(i) - two.world(i)).norm());
  }
  EXPECT_GT(lowest, 0.4);  // all octaves together are less than twice the first one's 0.25
  EXPECT_LT(highest, 1.6);
  EXPECT_GT(highest - lowest, 0.2);
  EXPECT_GT(difference, 0.1);
}

TEST(Recipes, RefuseWhatTheyDoNotKnow) {
  EXPECT_NE(error_in([] { make("sponge"); }).find("sponge"), std::string::npos);
  EXPECT_NE(error_in([] { make("torus", {{"holes", 2}}); }).find("holes"), std::string::npos);
  for (const double around : {2.0, std::nan("")})
    EXPECT_NE(error_in([&] { make("torus", {{"around", around}}); }).find("around"), std::string::npos);
}

TEST(CloseHoles, FillsEveryLoopAndDropsStrayPoints) {
  PolygonMesh sphere = make("uv-sphere");
  const double whole = volume(sphere);
  sphere.points.insert(sphere.points.begin(), Eigen::Vector3f(9, 9, 9));
  for (Triangle& triangle : sphere.triangles)
    for (std::uint32_t& corner : triangle) ++corner;
  std::erase_if(sphere.triangles,
                [](const Triangle& triangle) { return std::ranges::count(triangle, 1u) > 0; });
  sphere.triangles.erase(sphere.triangles.begin() + 500);
  ASSERT_FALSE(closed_and_oriented(sphere));
  const PolygonMesh closed = close_holes(sphere);
  EXPECT_TRUE(closed_and_oriented(closed));
  EXPECT_EQ(euler_characteristic(closed), 2);
  EXPECT_NEAR(volume(closed), whole, 1e-3);
}

TEST(CloseHoles, RefusesWhatIsAmbiguous) {
  PolygonMesh mesh;
  mesh.points.resize(5, Eigen::Vector3f::Zero());
  mesh.triangles = {{0, 1, 2}, {0, 3, 4}};
  EXPECT_NE(error_in([&] { close_holes(mesh); }).find("touch in a point"), std::string::npos);
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}};
  EXPECT_NE(error_in([&] { close_holes(mesh); }).find("more than two polygons"), std::string::npos);
}

/// Environment variables and a folder for the time of a test.
class CasesTest : public testing::Test {
 protected:
  CasesTest() {
    std::string pattern = (fs::temp_directory_path() / "hermesh-test-XXXXXX").string();
    folder = mkdtemp(pattern.data());
    fs::create_directories(folder / "data");
    set("HERMESH_DATA", folder / "data");
    set("HERMESH_CACHE", folder / "cache");
    set("HERMESH_OFFLINE", "1");
  }
  ~CasesTest() override {
    for (const auto& [name, value] : saved)
      value ? setenv(name.c_str(), value->c_str(), 1) : unsetenv(name.c_str());
    fs::remove_all(folder);
  }

  void set(const std::string& name, const std::optional<std::string>& value) {
    const char* const before = std::getenv(name.c_str());
    saved.emplace_back(name, before ? std::optional<std::string>(before) : std::nullopt);
    std::rotate(saved.begin(), saved.end() - 1, saved.end());  // the first value of all is put back last
    value ? setenv(name.c_str(), value->c_str(), 1) : unsetenv(name.c_str());
  }
  void write(const fs::path& path, const std::string& text) {
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
  }
  /// Makes `toml` the recipes of all calls that follow in the test.
  void use_recipes(const std::string& toml) {
    write(folder / "experiments" / "cases.toml", toml);
    set("HERMESH_EXPERIMENTS", folder / "experiments");
  }
  std::string recipe_error(const std::string& toml) {
    use_recipes(toml);
    return error_in([] { list_cases(); });
  }

  fs::path folder;
  RunContext context;
  std::vector<std::pair<std::string, std::optional<std::string>>> saved;
};

const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
// sha256sum of the text above, and of the same with another last polygon, "f 1 3 2".
const std::string triangle_sha256 = "697b00ab13410c52a542d2e9c63711fcc04e9cbf6c0d3439a9b43cc812e6e713";
const std::string turned_sha256 = "3d7ecd8cef0eac11ce7bbd5bcd55e3cff52f6209306e0d33ef54731be9225f4f";

std::string one_case(const std::string& files) {
  return "[[case]]\nname = \"part\"\nsummary = \"x\"\nfiles = [" + files +
         "]\ntriangles = 20000\nstand_in = \"noise-sphere\"\n";
}
std::string file_entry(const std::string& name, const std::string& sha256, const std::string& from = "") {
  return "{ file = \"" + name + "\", sha256 = \"" + sha256 + "\", source = \"here\", licence = \"ours\"" +
         (from.empty() ? "" : ", from = \"" + from + "\"") + " }";
}

TEST_F(CasesTest, TheRecipesOfTheProjectAreInOrder) {
  const std::vector<CaseInfo> cases = list_cases();
  ASSERT_FALSE(cases.empty());
  EXPECT_EQ(cases[0].name, "dragon");
  EXPECT_EQ(cases[0].kind, "file");
  std::set<std::string> files;
  for (const CaseRecipe& recipe : read_case_file(experiments_folder() / "cases.toml"))
    for (const CaseFile& file : recipe.files) {
      EXPECT_NE(is_mesh_path(file.name), recipe.is_volume) << file.name;
      EXPECT_TRUE(files.insert(file.name).second) << file.name;
      EXPECT_EQ(file.sha256.size(), 64u) << file.name;
    }
}

/// Generated cases must have the stated hash, which load_case() compares. Ten million triangles take too long
/// for every run, and so does one million where nothing is optimised.
TEST_F(CasesTest, GeneratedCasesHaveTheStatedHash) {
#ifdef NDEBUG
  constexpr double most = 1e6;
#else
  constexpr double most = 1e5;
#endif
  std::size_t generated = 0;
  for (const CaseRecipe& recipe : read_case_file(experiments_folder() / "cases.toml")) {
    const auto triangles = recipe.parameters.find("triangles");
    if (recipe.recipe.empty() || (triangles != recipe.parameters.end() && triangles->second > most)) continue;
    const LoadedCase loaded = load_case(recipe.name, context);
    EXPECT_EQ(loaded.origin, "generated") << recipe.name;
    EXPECT_EQ(loaded.sha256, recipe.sha256) << recipe.name;
    EXPECT_EQ(loaded.sha256, sha256_of_mesh(loaded.mesh)) << recipe.name;
    ++generated;
  }
  EXPECT_GE(generated, 9u);
}

TEST_F(CasesTest, ParametersOfAGeneratedCaseMayBeChanged) {
  const LoadedCase thin = load_changed_case("plate", {{"thickness", 0.5}}, context);
  EXPECT_EQ(thin.origin, "generated");
  EXPECT_NEAR(volume(thin.mesh), 80 * 80 * 0.5, 0.1);
  EXPECT_NE(thin.sha256, load_case("plate", context).sha256);
  EXPECT_THROW(load_changed_case("plate", {{"thicknes", 0.5}}, context), Error);
  EXPECT_THROW(load_changed_case("dragon", {{"radius", 1}}, context), Error);
  EXPECT_THROW(load_changed_case("nothing", {}, context), Error);
}

TEST_F(CasesTest, TakesTheFileOfTheDataFolder) {
  use_recipes(one_case(file_entry("part.obj", triangle_sha256)));
  write(folder / "data" / "part.obj", triangle);
  const LoadedCase loaded = load_case("part", context);
  EXPECT_EQ(loaded.name, "part");
  EXPECT_EQ(loaded.origin, "data folder");
  EXPECT_EQ(loaded.sha256, triangle_sha256);
  EXPECT_EQ(loaded.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
}

TEST_F(CasesTest, FallsBackToTheCacheAndTakesTheSecondFile) {
  use_recipes(
      one_case(file_entry("none.obj", turned_sha256) + ", " + file_entry("part.obj", triangle_sha256)));
  write(folder / "cache" / "part.obj", triangle);
  EXPECT_EQ(load_case("part", context).origin, "package registry");
  write(folder / "data" / "none.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 3 2\n");
  EXPECT_EQ(load_case("part", context).origin, "data folder");
  set("HERMESH_CACHE", std::nullopt);
  set("HERMESH_DATA", std::nullopt);
  set("XDG_CACHE_HOME", folder / "xdg");
  write(folder / "xdg" / "hermesh" / "part.obj", triangle);
  EXPECT_EQ(load_case("part", context).origin, "package registry");
}

TEST_F(CasesTest, RefusesAnotherFileOfTheSameName) {
  use_recipes(one_case(file_entry("part.obj", triangle_sha256)));
  write(folder / "data" / "part.obj", triangle + "\n");
  const std::string error = error_in([&] { load_case("part", context); });
  EXPECT_NE(error.find("part.obj is not the file of case part"), std::string::npos) << error;
  EXPECT_NE(error.find(triangle_sha256), std::string::npos) << error;
}

TEST_F(CasesTest, WithoutTheFileAStandInOfTheSameSizeSaysWhy) {
  use_recipes(one_case(file_entry("one.obj", triangle_sha256) + ", " +
                       file_entry("two.obj", triangle_sha256, "npm nothing@1.0.0 package/two.obj")));
  const LoadedCase loaded = load_case("part", context);
  EXPECT_TRUE(loaded.origin.starts_with("stand-in: noise-sphere of the same size, because one.obj"));
  EXPECT_NE(loaded.origin.find("two.obj is not in the data folder, and HERMESH_OFFLINE"), std::string::npos);
  EXPECT_NEAR(static_cast<double>(loaded.mesh.triangle_count()), 20000.0, 200.0);
  EXPECT_EQ(loaded.sha256, sha256_of_mesh(loaded.mesh));
}

TEST_F(CasesTest, WhereNothingCanBeFetchedThereIsAStandIn) {
  use_recipes(one_case(file_entry("three.obj", triangle_sha256, "npm nothing@1.0.0 package/three.obj")));
  set("HERMESH_OFFLINE", std::nullopt);
  set("PATH", "");
  const std::string origin = load_case("part", context).origin;
  EXPECT_TRUE(origin.starts_with("stand-in: noise-sphere of the same size, because three.obj")) << origin;
}

TEST_F(CasesTest, HolesAreClosedInWhateverMeshThereIs) {
  use_recipes(one_case(file_entry("part.obj", triangle_sha256)) +
              "[[case]]\nname = \"closed\"\nsummary = \"x\"\nclose_holes_of = \"part\"\nsha256 = \"0\"\n");
  require_data(true);
  const std::string refused = error_in([&] { load_case("part", context); });
  EXPECT_TRUE(refused.starts_with("the case part would be a stand-in, because ")) << refused;
  EXPECT_THROW(load_case("closed", context), DataMissing);
  EXPECT_FALSE(is_at_hand("part", context));
  require_data(false);
  EXPECT_TRUE(load_case("closed", context).origin.starts_with("stand-in: "));
  write(folder / "data" / "part.obj", triangle);
  // The hash in the recipe is wrong on purpose.
  EXPECT_NE(error_in([&] { load_case("closed", context); }).find("case closed came out with the SHA-256"),
            std::string::npos);
}

TEST_F(CasesTest, AnotherCaseStandsIn) {
  std::string private_case = one_case(file_entry("mine.obj", turned_sha256));
  private_case.replace(private_case.find("part"), 4, "mine");
  private_case.replace(private_case.find("noise-sphere"), 12, "part");
  use_recipes(one_case(file_entry("part.obj", triangle_sha256)) + private_case);
  EXPECT_TRUE(
      load_case("mine", context).origin.starts_with("stand-in: noise-sphere of the same size, because "));
  write(folder / "data" / "part.obj", triangle);
  const LoadedCase loaded = load_case("mine", context);
  EXPECT_EQ(loaded.name, "mine");
  EXPECT_EQ(
      loaded.origin,
      "stand-in: the case part, because mine.obj is not in the data folder, and it has no public source");
  EXPECT_EQ(loaded.sha256, triangle_sha256);
  EXPECT_FALSE(is_at_hand("mine", context));
  require_data(true);
  EXPECT_THROW(load_case("mine", context), DataMissing);
  require_data(false);
  EXPECT_NE(recipe_error(private_case).find("'stand_in' must be a recipe or a case above it that has files"),
            std::string::npos);
}

TEST_F(CasesTest, FacesAgreeInWhateverMeshThereIs) {
  use_recipes(one_case(file_entry("part.obj", triangle_sha256)) +
              "[[case]]\nname = \"agreed\"\nsummary = \"x\"\nagree_faces_of = \"part\"\nsha256 = \"0\"\n");
  EXPECT_TRUE(load_case("agreed", context).origin.starts_with("stand-in: "));
}

TEST_F(CasesTest, APathIsReadAsAFile) {
  write(folder / "mine.obj", triangle);
  const LoadedCase loaded = load_case((folder / "mine.obj").string(), context);
  EXPECT_EQ(loaded.origin, "file");
  EXPECT_EQ(loaded.sha256, triangle_sha256);
  EXPECT_NE(error_in([&] { load_case("unicorn", context); }).find("there is no case 'unicorn'"),
            std::string::npos);
  EXPECT_NE(error_in([&] { load_case("none.ply", context); }).find("none.ply"), std::string::npos);
}

TEST_F(CasesTest, MistakesInTheRecipesNameFileAndLine) {
  const std::string path = (folder / "experiments" / "cases.toml").string();
  const std::string start = "[[case]]\nname = \"a\"\nsummary = \"x\"\n";
  const std::string good = start + "recipe = \"torus\"\nsha256 = \"\"\n";
  EXPECT_EQ(recipe_error(good), "");
  for (const auto& [toml, line, named] :
       {std::tuple(good + "colour = 1\n", 6, "colour"),
        {start + "recipe = \"sponge\"\nsha256 = \"\"\n", 4, "sponge"},
        {start + "recipe = \"torus\"\n", 1, "sha256"},
        {start + "recipe = 3\nsha256 = \"\"\n", 4, "recipe"},
        {start + "close_holes_of = \"b\"\nsha256 = \"\"\n", 1, "close_holes_of"},
        {good + good, 6, "'a'"},
        {std::string("name = \n"), 1, ""}}) {
    const std::string error = recipe_error(toml);
    EXPECT_TRUE(error.starts_with(path + ", line " + std::to_string(line) + ": ")) << error;
    EXPECT_NE(error.find(named, path.size()), std::string::npos) << error;
  }
}

}  // namespace cases_test
}  // namespace hermesh
