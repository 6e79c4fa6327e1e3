// numpy's arrays over the C++ ones and back. Only bindings of this folder include it.
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

/// An array over memory that `owner`, which is kept by it, holds alive; nobody may write into it, since
/// copies of a mesh share their arrays.
template <class T, class Owner>
py::array view(std::span<const T> values, std::vector<py::ssize_t> shape, Owner owner) {
  const py::capsule keeper(new Owner(std::move(owner)), [](void* p) { delete static_cast<Owner*>(p); });
  py::array_t<T> array(std::move(shape), values.data(), keeper);
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

/// An array that owns a vector, which is moved and not copied.
template <class T>
py::array owning(std::vector<T>&& values, std::vector<py::ssize_t> shape) {
  auto* held = new std::vector<T>(std::move(values));
  const py::capsule keeper(held, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>(std::move(shape), held->data(), keeper);
}

/// What was given as an array of numbers side by side, of its own type where `kinds` (numpy's letters, such
/// as "f4 f8") names it and of the type `fallback` otherwise; not copied unless one of both asks for it.
/// @throws Error where it is no array of numbers.
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

/// @throws Error unless the array is of rows of so many numbers; one of nothing at all has no rows.
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
