// What the tools' exit status means; docs/cli.md documents it for scripts.
#pragma once

#include <string>

#include "core/base/status.h"

namespace stance {

enum class ExitCode : int {
  kOk = 0,
  kInternal = 1,  // our own bug, or the server's
  kUsage = 2,     // the command line
  kBadInput = 3,  // a file's content, or a request that the server refuses as wrong
  kFile = 4,      // a file or a model that can't be read or written
  kServer = 5,    // no server, an overloaded one, or the deadline has passed
  kUnsure = 6,    // a transfer below --min-confidence; its outputs are written all the same
};

// The exit code that one of the functions below has attached; otherwise the one that the status code
// alone means, for a status from the computation or a model's load.
ExitCode ExitCodeFor(const absl::Status& status);

// OK stays OK. A status from parsing the command line.
absl::Status UsageError(const absl::Status& status);
// A status from reading or writing a file: INVALID_ARGUMENT is about its content, everything else about the
// file.
absl::Status FileError(const absl::Status& status);
// A status from a call to a server. NOT_FOUND is then a name in the request (a model), not a file.
absl::Status ServerError(const absl::Status& status);

// A status about a result that is there but not to be trusted.
absl::Status UnsureError(const absl::Status& status);

// "stance: text", in one line whatever the text, with a line feed.
std::string ErrorLine(const std::string& program, const absl::Status& status);

}  // namespace stance
