// hermesh import: converts scalar volumes of other programs to .vdb.
#include <charconv>
#include <cmath>
#include <memory>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"
#include "algorithms/io/import/import_volume.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/signals.h"

namespace hermesh::cli {
namespace {

struct ImportArguments {
  Paths paths;
  std::optional<std::string> dims, type, spacing;
  std::uint64_t offset = 0;
  std::optional<std::int64_t> frame;
  std::optional<double> replacement;
  bool labels = false;
};

/// Reads three numbers with commas between them. @throws UsageError
template <class T>
std::array<T, 3> three_numbers(const std::string& option, const std::string& given) {
  std::array<T, 3> numbers{};
  const char* at = given.data();
  const char* const end = at + given.size();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto [stop, status] = std::from_chars(at, end, numbers[i]);
    const bool good =
        status == std::errc() && numbers[i] > 0 && (i < 2 ? stop != end && *stop == ',' : stop == end);
    if (!good || !std::isfinite(double(numbers[i])))
      throw UsageError(option +
                       " must be three numbers above 0 with commas between them, such as 256,256,108, not '" +
                       given + "'");
    at = stop + 1;
  }
  return numbers;
}

RawLayout raw_layout(const ImportArguments& arguments, Session& session) {
  if (!arguments.type) throw UsageError("--dims declares raw samples: pass their --type, such as int16le");
  RawLayout layout;
  layout.dims = three_numbers<std::int64_t>("--dims", *arguments.dims);
  layout.format = as_usage([&] { return parse_sample_format(*arguments.type); });
  layout.offset = arguments.offset;
  if (arguments.spacing)
    layout.spacing = three_numbers<double>("--spacing", *arguments.spacing);
  else
    session.context.note("no --spacing was given; 1,1,1 is assumed");
  if (arguments.frame) throw UsageError("--frame concerns NIfTI files; for raw samples use --offset");
  return layout;
}

void check_nifti(const ImportArguments& arguments) {
  if (arguments.type || arguments.spacing || arguments.offset != 0)
    throw UsageError("--type, --spacing and --offset concern raw samples: pass their --dims, too");
  if (!is_nifti_path(arguments.paths.in))
    throw UsageError(
        "unknown format of '" + arguments.paths.in +
        "': its name ends neither in .nii, .hdr nor .img (.gz may follow); for raw samples pass --dims, "
        "--type and --spacing");
}

int import_labels(const ImportArguments& arguments, const std::optional<RawLayout>& layout,
                  const ImportOptions& options, Session& session) {
  Stopwatch watch;
  const ImportedLabels labels = layout
                                    ? import_raw_labels(arguments.paths.in, *layout, options, session.context)
                                    : import_nifti_labels(arguments.paths.in, options, session.context);
  write_imported(arguments.paths.out, labels, session.context);
  work_is_finished();
  Json list = Json::array();
  for (const auto& [label, samples] : labels.samples)
    list.push_back({{"label", label}, {"samples", samples}});
  made(session, "samples", labels.dims);
  made(session, "lowest", 0);
  made(session, "highest", labels.samples.rbegin()->first);
  made(session, "voxel_size", labels.voxel_size);
  made(session, "grids", std::vector<std::string>{"labels"});
  made(session, "labels", list);
  print_summary(session, "imported " + arguments.paths.in + ": " + std::to_string(labels.dims[0]) + " x " +
                             std::to_string(labels.dims[1]) + " x " + std::to_string(labels.dims[2]) +
                             " samples, " + std::to_string(list.size()) + " labels up to " +
                             std::to_string(labels.samples.rbegin()->first) + ", " +
                             seconds_text(watch.seconds()));
  return kDone;
}

int run_import(const ImportArguments& arguments, Session& session) {
  ImportOptions options{.replacement = {}, .frame = arguments.frame};
  if (arguments.replacement) {
    options.replacement = static_cast<float>(*arguments.replacement);
    if (!std::isfinite(*options.replacement))
      throw UsageError("--replace-nan takes a value of single precision, at most 3.4e38 in magnitude");
  }
  std::optional<RawLayout> layout;
  if (arguments.dims)
    layout = raw_layout(arguments, session);
  else
    check_nifti(arguments);
  check_volume_output(arguments.paths.out);
  if (arguments.labels) return import_labels(arguments, layout, options, session);
  Stopwatch watch;
  const LevelSet volume = layout ? import_raw(arguments.paths.in, *layout, options, session.context)
                                 : import_nifti(arguments.paths.in, options, session.context);
  write_imported(arguments.paths.out, volume, session.context);
  work_is_finished();
  const std::array<int, 3> dims = volume.dimensions();
  const auto [lowest, highest] = value_range(volume);
  made(session, "samples", dims);
  made(session, "lowest", lowest);
  made(session, "highest", highest);
  made(session, "voxel_size", volume.voxel_size());
  made(session, "grids", std::vector<std::string>{"volume"});
  print_summary(session, "imported " + arguments.paths.in + ": " + std::to_string(dims[0]) + " x " +
                             std::to_string(dims[1]) + " x " + std::to_string(dims[2]) + " samples, values " +
                             text(lowest) + " to " + text(highest) + ", " + seconds_text(watch.seconds()));
  return kDone;
}

}  // namespace

void add_import(CLI::App& app, Session& session) {
  const auto arguments = std::make_shared<ImportArguments>();
  CLI::App* command = add_command(app, session, "import",
                                  "Convert a volume of another program (NIfTI-1, raw samples) to .vdb");
  add_paths(
      *command, session, arguments->paths,
      "Volume: .nii .hdr .img, or with --dims raw samples; all also gzipped; or - for the standard input",
      FileKind::imported,
      "Volume: .vdb, the grid `volume` (with --labels `labels`) in millimetres, or - for the standard output",
      FileKind::volume);
  add_json_option(*command, session);
  command->add_flag("--labels", arguments->labels,
                    "Import a label map: samples are whole numbers from 0, the background, to 2147483647, "
                    "and stay integers (then: hermesh extract --labels all)");
  command->add_option("--frame", arguments->frame,
                      "Index of the volume in a NIfTI file, from 0 (default: the first)");
  command->add_option("--dims", arguments->dims,
                      "Raw: X,Y,Z, the numbers of samples; x varies fastest in the file");
  command->add_option(
      "--type", arguments->type,
      "Raw: uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64, followed by le "
      "(default) or be");
  command->add_option("--spacing", arguments->spacing,
                      "Raw: A,B,C, the distances of samples in mm (default: 1,1,1)");
  command->add_option("--offset", arguments->offset, "Raw: bytes before the first sample (default: 0)")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000'000'000}));
  command
      ->add_option("--replace-nan", arguments->replacement,
                   "Value that replaces samples that are not finite (default: such a volume is refused)")
      ->check(finite_number());
  set_work(*command, session, [arguments, &session] { return run_import(*arguments, session); });
}

}  // namespace hermesh::cli
