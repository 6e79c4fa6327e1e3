// All of CLI11, so that what cli11.h leaves out is compiled somewhere.
#include <CLI/CLI.hpp>
