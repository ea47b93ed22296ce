// The program `rilievo`, but for its main().
#pragma once

namespace rilievo {

// Parses the command line, runs the command, prints errors. Returns the exit code.
int RunProgram(int argc, const char* const* argv);

}  // namespace rilievo
