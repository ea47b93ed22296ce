#include "client/cli/program.h"

int main(int argc, char** argv) { return rilievo::RunProgram(argc, argv); }
