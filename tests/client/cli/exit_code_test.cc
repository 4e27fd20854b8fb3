#include "client/cli/exit_code.h"

#include <gtest/gtest.h>

#include <set>

namespace stance {
namespace {

absl::Status Error(int code) { return absl::Status(static_cast<absl::StatusCode>(code), "text"); }

TEST(ExitCodeTest, OkIsZeroThroughEveryFunction) {
  for (const absl::Status& status :
       {absl::OkStatus(), UsageError(absl::OkStatus()), FileError(absl::OkStatus()),
        ServerError(absl::OkStatus()), UnsureError(absl::OkStatus())}) {
    EXPECT_TRUE(status.ok());
    EXPECT_EQ(ExitCodeFor(status), ExitCode::kOk);
  }
}

TEST(ExitCodeTest, EveryCodeFromComputing) {
  using Code = absl::StatusCode;
  const std::set<Code> input = {Code::kInvalidArgument, Code::kOutOfRange, Code::kFailedPrecondition,
                                Code::kUnimplemented};
  const std::set<Code> file = {Code::kNotFound, Code::kAlreadyExists, Code::kPermissionDenied,
                               Code::kDataLoss};
  const std::set<Code> server = {Code::kUnavailable, Code::kDeadlineExceeded, Code::kResourceExhausted,
                                 Code::kCancelled,   Code::kAborted,          Code::kUnauthenticated};
  for (int i = 1; i <= 16; ++i) {
    const auto code = static_cast<Code>(i);
    const ExitCode expected = input.contains(code)    ? ExitCode::kBadInput
                              : file.contains(code)   ? ExitCode::kFile
                              : server.contains(code) ? ExitCode::kServer
                                                      : ExitCode::kInternal;
    EXPECT_EQ(ExitCodeFor(Error(i)), expected) << i;
    EXPECT_EQ(ExitCodeFor(UsageError(Error(i))), ExitCode::kUsage) << i;
    EXPECT_EQ(ExitCodeFor(UnsureError(Error(i))), ExitCode::kUnsure) << i;
    EXPECT_EQ(ExitCodeFor(FileError(Error(i))),
              code == Code::kInvalidArgument ? ExitCode::kBadInput : ExitCode::kFile)
        << i;
  }
}

TEST(ExitCodeTest, WhatAServerSaysIsNeverAboutAFile) {
  for (int i = 1; i <= 16; ++i) EXPECT_NE(ExitCodeFor(ServerError(Error(i))), ExitCode::kFile) << i;
  EXPECT_EQ(ExitCodeFor(ServerError(absl::NotFoundError("no such model"))), ExitCode::kBadInput);
  EXPECT_EQ(ExitCodeFor(ServerError(absl::UnavailableError(""))), ExitCode::kServer);
}

TEST(ErrorLineTest, IsOneLineWithTheProgramsName) {
  EXPECT_EQ(ErrorLine("stance", absl::InternalError("a\nb\tc\n")), "stance: a b c\n");
  EXPECT_EQ(ErrorLine("stance", absl::UnavailableError("")), "stance: UNAVAILABLE\n");
}

}  // namespace
}  // namespace stance
