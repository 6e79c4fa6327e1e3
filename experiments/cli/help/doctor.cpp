#include "experiments/cli/help/doctor.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "experiments/cli/laboratory.h"

namespace hermesh::cli {
namespace {

namespace fs = std::filesystem;

std::string first_that_is_there(const std::vector<fs::path>& places) {
  std::error_code error;
  for (const fs::path& place : places)
    if (fs::exists(place, error)) return place.string();
  return "";
}

Check of_program(const std::string& feature, const std::string& program, const std::string& package) {
  return {feature, program, find_program(program), "apt-get install " + package};
}

Check of_data() {
  const char* folder = std::getenv("HERMESH_DATA");
  Check check{"experiments on the scans of the thesis, else stand-ins", "the folder $HERMESH_DATA", "",
              "export HERMESH_DATA=FOLDER with the models, or install npm, by which the Dragon is fetched on "
              "first use"};
  std::error_code error;
  if (folder && fs::is_directory(folder, error)) check.found = folder;
  if (folder && check.found.empty())
    check.remedy = "HERMESH_DATA names '" + std::string(folder) + "', which is no folder; " + check.remedy;
  return check;
}

Check of_experiments() {
  Check check{"run, report, claims and other commands of the laboratory", "the directory of experiments", "",
              "export HERMESH_EXPERIMENTS=CHECKOUT/experiments, from a clone of the project"};
  const fs::path folder = experiments_directory();
  std::error_code error;
  if (fs::exists(folder / "questions", error)) check.found = folder.string();
  return check;
}

}  // namespace

std::string find_program(const std::string& name) {
  const char* folders = std::getenv("PATH");
  std::istringstream stream(folders ? folders : "");
  for (std::string folder; std::getline(stream, folder, ':');) {
    const fs::path file = fs::path(folder.empty() ? "." : folder) / name;
    std::error_code error;
    if (fs::is_regular_file(file, error) && access(file.c_str(), X_OK) == 0) return file.string();
  }
  return "";
}

std::vector<Check> all_checks() {
  return {
      of_experiments(),
      of_data(),
      of_program("fetching models, peers in JavaScript", "npm", "npm"),
      of_program("the laboratory (run, report, claims, compare), peers in Python", "python3",
                 "python3 python3-scipy python3-matplotlib python3-jinja2"),
      of_program("commits in rows, rows that are kept", "git", "git"),
      of_program("./reproduce --paper", "pdflatex",
                 "texlive-latex-base texlive-latex-recommended texlive-fonts-recommended"),
      {"plots in the paper", "fonts of LaTeX",
       first_that_is_there({"/usr/share/texlive/texmf-dist/fonts/type1/public/amsfonts",
                            "/usr/share/texlive/texmf-dist/fonts/type1/urw"}),
       "apt-get install texlive-fonts-recommended"},
      of_program("panels in a host", "blender", "blender"),
      of_program("tests of the page of results", "chromium", "chromium"),
      of_program("sweeps on all cores", "snakemake", "snakemake"),
      of_program("sweeps on a cluster", "sbatch", "slurm-wlm munge"),
      of_program("a look into .vdb files by others", "vdb_print", "libopenvdb-tools"),
      of_program("building, ./test", "cmake", "cmake ninja-build g++"),
      of_program("tests of the manual page", "man", "man-db"),
  };
}

}  // namespace hermesh::cli
