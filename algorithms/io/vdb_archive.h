// What reading and writing .vdb files of any content have in common. Heavy (OpenVDB): include it from .cpp
// files.
#pragma once

#include <openvdb/io/File.h>

#include <filesystem>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/core/openvdb_trees.h"
#include "algorithms/core/shown.h"
#include "algorithms/io/vdb_structure.h"

namespace hermesh {

/// Key of the metadata (vec3d) of a grid of positions that says where these have their zero in the world, so
/// that single precision keeps far from the origin of the world what it keeps near it. (Several programs take
/// no grids of vectors in double precision.)
inline constexpr const char* kZeroOfPositions = "hermesh_origin";

/// Runs f and turns what OpenVDB throws into one sentence about the file.
template <class F>
auto about_vdb_file(const std::filesystem::path& path, F&& f) {
  try {
    return f();
  } catch (const openvdb::LookupError& e) {
    throw Error(path.string() + " holds a grid of a type that this program does not know (" +
                shown(e.what()) + ")");
  } catch (const openvdb::Exception& e) {
    throw Error(path.string() + " cannot be read as a .vdb file (" + shown(e.what(), 100) +
                "); is it complete?");
  } catch (const std::bad_alloc&) {
    throw Error(path.string() + " asks for more memory than there is; is it complete?");
  } catch (const std::length_error&) {
    throw Error(path.string() + " asks for more memory than there is; is it complete?");
  }
}

/// Reads the grids of a .vdb file, each of which is checked (vdb_structure.h) before OpenVDB reads it. Its
/// functions are for use within about_vdb_file().
class VdbReader {
 public:
  /// Opens and checks the file, after initialize_openvdb(). @throws Error for a file that is missing, of
  /// another kind, truncated or damaged: the checksum of a file that write_grids() wrote must fit, too.
  explicit VdbReader(const std::filesystem::path& path);

  /// Names of all grids, in ascending order.
  std::vector<std::string> names() const;
  std::string joined_names() const;  ///< with commas between them, as a sentence quotes them
  bool has(const std::string& name) const { return file_.hasGrid(name); }
  /// Whether the grid is of a type that read() reads.
  bool can_read(const std::string& name) const;
  /// The whole grid. @throws Error for a name that there is not, for damage, for more memory than there is,
  /// and for a transform that cannot be inverted.
  openvdb::GridBase::Ptr read(const std::string& name);
  /// Metadata and transform of a grid, with an empty tree. @throws Error as read() does.
  openvdb::GridBase::Ptr read_metadata(const std::string& name);

 private:
  const std::vector<const VdbDescriptor*> found(const std::string& name) const;
  openvdb::GridBase::Ptr with_good_transform(const std::string& name, openvdb::GridBase::Ptr grid) const;

  std::filesystem::path path_;
  std::unique_ptr<VdbStructure> structure_;
  openvdb::io::File file_;
};

/// Writes a file with a checksum and, in place of the random identifier that OpenVDB gives every file, one
/// made from the contents, so that the same grids give the same bytes. `named` is what an error calls the
/// file.
/// @throws Error if it cannot be written.
void write_sealed(const std::filesystem::path& file, const openvdb::GridCPtrVec& grids,
                  const std::filesystem::path& named);

/// Writes a file as write_sealed() does, aside and then renamed. @throws Error if the path cannot be written.
void write_grids(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids);

}  // namespace hermesh
