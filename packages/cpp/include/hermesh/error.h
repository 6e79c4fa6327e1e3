// Exceptions of the public functions.
#pragma once

#include <exception>
#include <stdexcept>

#include "hermesh/export.h"

namespace hermesh::HERMESH_V1 {

/// Invalid input, or a failure that the caller can fix. what() is the message of the program `hermesh`, which
/// names the file or the option and a remedy.
/// @snippet main.cpp error
class HERMESH_API Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
  ~Error() override;
};

/// Thrown by a call whose Context was cancelled. No partial file is left.
class HERMESH_API Cancelled : public std::exception {
 public:
  ~Cancelled() override;
  const char* what() const noexcept override;  ///< "cancelled"
};

}  // namespace hermesh::HERMESH_V1
