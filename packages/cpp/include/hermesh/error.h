// The two ways in which a call ends early.
#pragma once

#include <exception>
#include <stdexcept>

#include "hermesh/export.h"

namespace hermesh::HERMESH_V1 {

/// Bad input, or a failure that the caller can do something about. what() is one sentence, that of the
/// program `hermesh`, that names the file or the option and says what to do.
/// @snippet main.cpp error
class HERMESH_API Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  ~Error() override;
};

/// Thrown by a call whose Context was asked to stop. Nothing half-done is left behind.
class HERMESH_API Cancelled : public std::exception {
 public:
  ~Cancelled() override;
  const char* what() const noexcept override;  ///< "cancelled"
};

}  // namespace hermesh::HERMESH_V1
