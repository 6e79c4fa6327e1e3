// Certificates: proofs that two surfaces are within a distance of each other, which a reader can check
// without trusting this program. validation/check_certificate.py checks them in exact arithmetic.
//
// **The proof.** Each triangle of one surface is divided by lines, and each convex piece is assigned to a
// triangle of the other surface. If all corners of a piece are within the distance of its triangle, all of
// the piece is, for the distance from a convex set is a convex function. Lines are exact: a line is the
// points whose barycentric coordinates b in the divided triangle satisfy c·b = 0 for three whole numbers c.
// So the pieces have no gaps between them.
//
// **The file** is a line of JSON and compressed whole numbers (zlib) of 32 bits, little-endian:
//   format             "hermesh certificate 1"
//   error              the distance that is proved, in the unit of both files
//   input_triangles, output_triangles
//   cuts               true if polygons of the input have more than three corners: the numbers then begin
//                      with the corners of all triangles that they are cut into, in the order of the polygons
// The numbers are a tree for each triangle of the output, then for each of the input, in the order of the
// files: 1, c0, c1, c2 and two trees (c·b ≥ 0 and c·b ≤ 0) for a triangle or piece that is divided, 0 for a
// piece that is assigned to no triangle, n + 2 for one that is assigned. n is the step s from the triangle
// that was assigned last, 2 s for s ≥ 0 and −2 s − 1 for s < 0; before each 256th tree that is triangle 0.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/io/mesh_file.h"

namespace hermesh {

/// The trees of one direction, and what they do not cover.
struct CoverProof {
  std::vector<std::int32_t> numbers;
  std::uint64_t pieces = 0;     ///< that are assigned
  double uncovered_area = 0.0;  ///< of pieces that are assigned to no triangle, squared units of the points
};

/// Divides triangles into pieces within `distance` of a triangle of another surface each.
/// @param points the corners, any unit
/// @param offset of their origin from that of the other surface
/// @param other_points,other the other surface, not empty, in the same unit
/// @param distance greater than 0; reduced by 1e-7 of the other surface's extent for rounding
/// @return the same for any number of threads. @throws Cancelled
CoverProof cover(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles,
                 const Eigen::Vector3d& offset, std::span<const Eigen::Vector3f> other_points,
                 std::span<const Triangle> other, double distance, const RunContext& context);

/// What a certificate leaves open, world units².
struct CertificateReport {
  double uncovered_input = 0.0, uncovered_output = 0.0;  ///< areas
  std::uint64_t pieces = 0;
};

/// Writes a certificate of the distance between two meshes, in either direction. Parts that are farther away
/// are not covered, and reported.
/// @param input as read, with MeshFile::triangle_numbers
/// @param output the mesh that is written, which must have triangles only
/// @throws Error if the file cannot be written; Cancelled
CertificateReport write_certificate(const std::filesystem::path& path, const MeshFile& input,
                                    const PolygonMesh& output, double error, RunContext& context);

}  // namespace hermesh
