// Prints the FMU's modelDescription.xml. Arguments: the names of the files in sources/.
#include <iostream>

#include "description.hpp"

int main(int argc, char** argv) {
  std::string source_files;
  for (int i = 1; i < argc; ++i) source_files += std::string(argv[i]) + "\n";
  std::cout << fmi::description(fmi::table(), source_files);
  return std::cout.good() ? 0 : 1;
}
