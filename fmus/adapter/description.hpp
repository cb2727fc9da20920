// modelDescription.xml and the GUID, from the table.
#pragma once

#include <string>

#include "table.hpp"

namespace fmi {

/// A hash of everything the description says: two FMUs with the same GUID have the same variables.
const std::string& guid();

/// `source_files`: names in sources/, one per line, empty if the FMU carries none.
std::string description(const std::string& source_files);

struct LogCategory {
  const char *name, *description;
};
inline constexpr LogCategory log_categories[] = {
    {"logStatusError", "errors; always reported"},
    {"logStatusDiscard", "steps that could not be completed; always reported"},
    {"logStatusWarning", "warnings; always reported"},
    {"logEvents", "calls that change what the instance is doing"},
    {"logAll", "everything"},
};

inline constexpr int max_output_derivative_order = 1;

}  // namespace fmi
