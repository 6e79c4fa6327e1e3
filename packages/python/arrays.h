// Conversions between arrays of numpy and C++. Only bindings of this directory include it.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hermesh/error.h"

namespace hermesh::python {

namespace py = pybind11;

/// Returns a read-only array over memory of `owner`, which it keeps alive. Copies of a mesh share their
/// arrays.
template <class T, class Owner>
py::array view(std::span<const T> values, std::vector<py::ssize_t> shape, Owner owner) {
  const py::capsule keeper(new Owner(std::move(owner)), [](void* p) { delete static_cast<Owner*>(p); });
  py::array_t<T> array(std::move(shape), values.data(), keeper);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

/// Returns an array that owns a moved vector.
template <class T>
py::array owning(std::vector<T>&& values, std::vector<py::ssize_t> shape) {
  auto* held = new std::vector<T>(std::move(values));
  const py::capsule keeper(held, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>(std::move(shape), held->data(), keeper);
}

/// Returns a contiguous array of numbers, of its own type if `kinds` (numpy's letters, such as "f4 f8")
/// contains it, else of the type `fallback`; copied only if necessary. @throws Error if it is not an array of
/// numbers.
inline py::array contiguous(const py::handle& given, const std::string& kinds, const char* fallback,
                            const std::string& what) {
  const py::module_ numpy = py::module_::import("numpy");
  const py::array array = numpy.attr("asarray")(given);
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b')
    throw Error("the array of " + what + " holds no numbers but the type " +
                py::str(array.dtype()).cast<std::string>());
  const std::string code = kind + std::to_string(array.itemsize());
  const std::string type = kinds.find(code) == std::string::npos ? fallback : code;
  return numpy.attr("ascontiguousarray")(array, type);
}

/// @throws Error unless the rows of the array have `columns` numbers; an empty array has no rows.
inline void check_rows(const py::array& array, py::ssize_t columns, const std::string& what) {
  if (array.size() == 0 && array.ndim() <= 2) return;
  if (array.ndim() == 2 && array.shape(1) == columns) return;
  throw Error("the array of " + what + " must have the shape (n, " + std::to_string(columns) + "), not " +
              py::str(array.attr("shape")).cast<std::string>());
}

template <class T>
std::span<const T> span_of(const py::array& array) {
  return {static_cast<const T*>(array.data()), std::size_t(array.size())};
}

}  // namespace hermesh::python
