// The numbers that glTF's accessors are made of. Private to algorithms/io.
#pragma once

#include <cstddef>

namespace hermesh::mesh_formats {

// The numbers are constants of OpenGL, to which a renderer hands the buffers as they are.
/// Component types of accessors, by the numbers of OpenGL.
enum Component : std::size_t {
  kByte = 5120,
  kUnsignedByte = 5121,
  kShort = 5122,
  kUnsignedShort = 5123,
  kUnsignedInt = 5125,
  kFloat = 5126
};

/// Bytes of a number of a component type; 0 for a number that is none.
std::size_t size_of(std::size_t component);

/// A number of an accessor, at any address. Double precision holds all values of all of these types.
double number_at(const char* at, std::size_t component);

/// The largest value of a type of whole numbers, which stands for 1 where they are normalized.
double largest_of(std::size_t component);

}  // namespace hermesh::mesh_formats
