#include "core/network/safetensors.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/network/skeletal_networks.h"

namespace stance {
namespace {

TEST(Safetensors, WhatIsWrittenIsRead) {
  const TensorMap tensors = {{"a", torch::randn({3, 4})},
                             {"b.half", torch::randn({7}).to(torch::kFloat16)},
                             {"empty", torch::empty({0, 2})},
                             {"scalar", torch::tensor(2.5f)}};
  const auto read = ParseTensors(SerializeTensors(tensors));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->size(), tensors.size());
  for (const auto& [name, tensor] : tensors) {
    EXPECT_EQ(read->at(name).dtype(), tensor.dtype());
    EXPECT_TRUE(read->at(name).equal(tensor)) << name;
  }
}

TEST(Safetensors, DamagedBytesAreDataLossNeverACrash) {
  const std::string good = SerializeTensors({{"a", torch::randn({3, 4})}, {"b", torch::randn({5})}});
  for (size_t size = 0; size < good.size(); ++size) {
    EXPECT_EQ(ParseTensors(good.substr(0, size)).status().code(), absl::StatusCode::kDataLoss) << size;
  }
  Random random(1);
  for (int i = 0; i < 5000; ++i) {
    std::string bad = good;
    for (int k = 0; k < 3; ++k)
      bad[random.Below(static_cast<int64_t>(bad.size()))] = static_cast<char>(random.Below(256));
    const auto read = ParseTensors(bad);
    if (!read.ok()) {
      EXPECT_EQ(read.status().code(), absl::StatusCode::kDataLoss);
    }
  }
}

TEST(LoadModule, RestoresAModule) {
  torch::manual_seed(1);
  const WeightNetwork a;
  WeightNetwork b;
  ASSERT_TRUE(LoadModule(*b, "x.", ModuleTensors(*a, "x.", /*half=*/false)).ok());
  const auto expected = a->named_parameters(), found = b->named_parameters();
  for (const auto& item : expected) EXPECT_TRUE(found[item.key()].equal(item.value())) << item.key();
}

TEST(LoadModule, NamesTheTensorThatIsWrong) {
  JointNetwork module;
  TensorMap tensors = ModuleTensors(*module, "", false);
  tensors["out.bias"] = torch::zeros({4});
  auto status = LoadModule(*module, "", tensors);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(std::string(status.message()).find("out.bias"), std::string::npos);
  tensors["out.bias"] = torch::full({3}, std::numeric_limits<float>::quiet_NaN());
  EXPECT_FALSE(LoadModule(*module, "", tensors).ok());
  tensors.erase("out.bias");
  status = LoadModule(*module, "", tensors);
  EXPECT_NE(std::string(status.message()).find("missing"), std::string::npos);
}

}  // namespace
}  // namespace stance
