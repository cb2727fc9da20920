// Prints the table of an FMU's variables, for description.py.
#include <cstdio>

#include "table.hpp"

int main() { return std::fputs(fmi::printed_table().c_str(), stdout) < 0; }
