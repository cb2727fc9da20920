// Prints a description of the FMU: `2` or `3`, modelDescription.xml of FMI 2.0 or 3.0, `build3`, sources/
// buildDescription.xml of FMI 3.0. Second argument: a file that lists the files of sources/ to compile, one per line.
#include <fstream>
#include <iostream>

#include "description.hpp"

int main(int argc, char** argv) {
  const std::string which = argc > 1 ? argv[1] : "";
  std::vector<std::string> source_files;
  if (argc > 2) {
    std::ifstream list(argv[2]);
    if (!list) {
      std::cerr << "cannot read " << argv[2] << "\n";
      return 1;
    }
    for (std::string name; std::getline(list, name);) source_files.push_back(name);
  }
  if (which == "2")
    fmi::describe2(std::cout, source_files);
  else if (which == "3")
    fmi::describe3(std::cout);
  else if (which == "build3")
    fmi::describe_build3(std::cout, source_files);
  else
    return 2;
  return std::cout.good() ? 0 : 1;
}
