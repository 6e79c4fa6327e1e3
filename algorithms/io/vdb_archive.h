// Reads and writes .vdb files of any content. Heavy (OpenVDB): include it from .cpp files.
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

/// Key of the metadata (vec3d) of a grid of positions: their zero in the world, so that single precision
/// suffices far from the origin of the world. (Several programs read no vectors in double precision.)
inline constexpr const char* kZeroOfPositions = "hermesh_origin";

/// Runs f and turns the exceptions of OpenVDB into an Error that names the file.
template <class F>
auto about_vdb_file(const std::filesystem::path& path, F&& f) {
  try {
    return f();
  } catch (const openvdb::LookupError& e) {
    throw Error(path.string() + " holds a grid of an unknown type (" + shown(e.what()) + ")");
  } catch (const openvdb::Exception& e) {
    throw Error(path.string() + " cannot be read as a .vdb file (" + shown(e.what(), 100) +
                "); is it complete?");
  } catch (const std::bad_alloc&) {
    throw Error(path.string() + " needs more memory than is available; is it complete?");
  } catch (const std::length_error&) {
    throw Error(path.string() + " needs more memory than is available; is it complete?");
  }
}

/// Reads the grids of a .vdb file, after checking each (vdb_structure.h). To be used within about_vdb_file().
class VdbReader {
 public:
  /// Opens and checks the file, after initialize_openvdb(). @throws Error for a file that is missing, of
  /// another kind, truncated or damaged: the checksum of a file that write_grids() wrote must fit, too.
  explicit VdbReader(const std::filesystem::path& path);

  /// Returns the names of all grids, in ascending order.
  std::vector<std::string> names() const;
  std::string joined_names() const;  ///< separated by commas, for messages
  bool has(const std::string& name) const { return file_.hasGrid(name); }
  /// Returns true if the grid is of a type that read() reads.
  bool can_read(const std::string& name) const;
  /// Returns the whole grid. @throws Error for an unknown name, for damage, for too little memory, and for a
  /// transform that cannot be inverted.
  openvdb::GridBase::Ptr read(const std::string& name);
  /// Returns a grid with its metadata and transform and an empty tree. @throws Error like read().
  openvdb::GridBase::Ptr read_metadata(const std::string& name);

 private:
  std::vector<const VdbDescriptor*> found(const std::string& name) const;
  openvdb::GridBase::Ptr with_good_transform(const std::string& name, openvdb::GridBase::Ptr grid) const;

  std::filesystem::path path_;
  std::unique_ptr<VdbStructure> structure_;
  openvdb::io::File file_;
};

/// Writes a file with a checksum, and with an identifier made from the contents instead of OpenVDB's random
/// one, so that the same grids give the same bytes. `named` is the name for errors. @throws Error if it
/// cannot be written.
void write_sealed(const std::filesystem::path& file, const openvdb::GridCPtrVec& grids,
                  const std::filesystem::path& named);

/// Writes a file atomically like write_sealed(). @throws Error if the path cannot be written.
void write_grids(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids);

}  // namespace hermesh
