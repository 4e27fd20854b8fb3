// A model directory with random weights: for every test whose claim holds for any networks.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace stance::testing {

// Written on construction below the test's temporary folder, removed on destruction. Aborts if it can't be
// written.
class UntrainedModel {
 public:
  explicit UntrainedModel(int64_t samples, uint64_t seed = 2, const std::string& method = "skeletal");
  ~UntrainedModel();
  UntrainedModel(const UntrainedModel&) = delete;
  UntrainedModel& operator=(const UntrainedModel&) = delete;

  const std::filesystem::path& dir() const { return dir_; }

 private:
  std::filesystem::path dir_;
};

}  // namespace stance::testing
