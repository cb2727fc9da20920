// Prints the FMU's modelDescription.xml. Argument: a file that lists the files of sources/ to compile, one per line.
#include <fstream>
#include <iostream>
#include <iterator>

#include "description.hpp"

int main(int argc, char** argv) {
  std::string source_files;
  if (argc > 1) {
    std::ifstream list(argv[1]);
    if (!list) {
      std::cerr << "cannot read " << argv[1] << "\n";
      return 1;
    }
    source_files.assign(std::istreambuf_iterator<char>(list), {});
  }
  std::cout << fmi::description(source_files);
  return std::cout.good() ? 0 : 1;
}
