// CLI11 without the functions that write help and read files of options, which every object that sees them
// gets a copy of; cli11.cpp has them.
#pragma once

#include <CLI/App.hpp>
