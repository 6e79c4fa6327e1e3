// All of CLI11, to compile the parts that cli11.h leaves out.
#include <CLI/CLI.hpp>
