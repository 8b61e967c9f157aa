// Options of `halflight converge`.
#pragma once

#include "tools/cli/options.h"
#include "tools/halflight/arguments.h"

namespace halflight {

/// Declares all options of `halflight converge`.
void add_converge_options(CLI::App& app, ConvergeArguments& arguments);
void check_converge_options(const CLI::App& app, ConvergeArguments& arguments);

}  // namespace halflight
