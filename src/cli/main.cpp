#include "cli/program.hpp"

int main(int count, char** values) { return raypager::run_program({values + 1, values + (count > 0 ? count : 1)}); }
