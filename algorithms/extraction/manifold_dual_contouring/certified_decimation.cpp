#include "algorithms/extraction/manifold_dual_contouring/certified_decimation.h"

#include <algorithm>
#include <string>

#include "algorithms/extraction/manifold_dual_contouring/distance_certificate.h"

namespace hermesh {
namespace {

/// Each once, ascending.
void add_neighbours(const FineMesh& fine, std::vector<std::uint32_t>& samples) {
  const std::size_t n = samples.size();
  for (std::size_t i = 0; i < n; ++i)
    for (const std::uint32_t t : fine.around(samples[i])) samples.push_back(fine.next(t, samples[i]));
  std::sort(samples.begin(), samples.end());
  samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
}

}  // namespace

std::optional<DecimatedMesh> decimate_certified(const FineMesh& fine, const std::vector<float>& asked,
                                                const std::vector<std::uint8_t>& pinned, const FilePoints& file,
                                                RunContext& context) {
  constexpr int kAttempts = 4;
  std::vector<float> allowed = asked;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    DecimatedMesh mesh = begin_decimation(fine, allowed, pinned, context);
    decimate(mesh, asked, file, context);
    Stage stage(context, "certify");
    const DistanceCertificate certificate = certify_distance(mesh, asked, nullptr, context);
    if (certificate.holds()) {
      context.figure("attempts", attempt + 1);
      return mesh;
    }
    std::vector<std::uint32_t> concerned = certificate.samples;
    for (int ring = 0; ring < 2 * attempt; ++ring) add_neighbours(fine, concerned);
    for (const std::uint32_t sample : concerned) allowed[sample] = 0;
  }
  context.figure("attempts", kAttempts);
  context.note("The tolerance could not be proved in " + std::to_string(kAttempts) +
               " attempts, as may happen on noise, so this is the uniform mesh, in which nothing is merged");
  return std::nullopt;
}

}  // namespace hermesh
