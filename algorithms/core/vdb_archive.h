// What reading and writing .vdb files of any content have in common. Heavy (OpenVDB): include it from .cpp files.
#pragma once

#include <openvdb/openvdb.h>

#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>

#include "algorithms/core/error.h"

namespace hermesh {

/// Runs f and turns what OpenVDB throws into one sentence about the file.
template <class F>
auto about_vdb_file(const std::filesystem::path& path, F&& f) {
  try {
    return f();
  } catch (const openvdb::LookupError& e) {
    throw Error(path.string() + " holds a grid of a type that this program does not know (" + e.what() + ")");
  } catch (const openvdb::Exception& e) {
    throw Error(path.string() + " cannot be read as a .vdb file (" + e.what() + "); is it complete?");
  } catch (const std::bad_alloc&) {
    throw Error(path.string() + " asks for more memory than there is; is it complete?");
  } catch (const std::length_error&) {
    throw Error(path.string() + " asks for more memory than there is; is it complete?");
  }
}

/// Opens a file with initialize_openvdb() done, all grids to be read at once and not when they are first used.
/// @throws Error for a file that is missing, of another kind, truncated (OpenVDB itself takes the bytes that are
/// missing at the end for zeros) or damaged: what write_grids() wrote has a checksum, and in other files at least the
/// lengths before the data are compared with what there is. Call it within about_vdb_file().
void open_vdb(openvdb::io::File& file, const std::filesystem::path& path);

/// Names of the grids, separated by commas.
std::string grid_names(const openvdb::io::File& file);

/// Writes a file with a checksum and, in place of the random identifier that OpenVDB gives every file, one made from the
/// contents, so that the same grids give the same bytes. `named` is what an error calls the file.
/// @throws Error if it cannot be written.
void write_sealed(const std::filesystem::path& file, const openvdb::GridCPtrVec& grids,
                  const std::filesystem::path& named);

/// The same aside, then renames.
void write_grids(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids);

}  // namespace hermesh
