#include "server/client_key.h"

#include <gtest/gtest.h>

namespace stance {
namespace {

TEST(ClientKeyTest, IsThePeersHost) {
  EXPECT_EQ(ClientKey("ipv4:10.0.0.7:51234", std::nullopt), "ipv4:10.0.0.7");
  EXPECT_EQ(ClientKey("ipv4:10.0.0.7:51235", std::nullopt), "ipv4:10.0.0.7");
  EXPECT_EQ(ClientKey("ipv6:%5B::1%5D:51234", std::nullopt), "ipv6:%5B::1%5D");
  EXPECT_EQ(ClientKey("ipv6:[::1]:51234", std::nullopt), "ipv6:[::1]");
  EXPECT_EQ(ClientKey("unix:/run/stance.sock", std::nullopt), "unix:/run/stance.sock");
  EXPECT_EQ(ClientKey("", std::nullopt), "");
}

TEST(ClientKeyTest, IsTheCallersNameWhereThereIsOne) {
  EXPECT_EQ(ClientKey("ipv4:10.0.0.7:51234", "studio"), "name:studio");
  EXPECT_EQ(ClientKey("ipv4:10.0.0.7:51234", ""), "ipv4:10.0.0.7");
  EXPECT_NE(ClientKey("ipv4:10.0.0.8:1", "ipv4:10.0.0.7"), ClientKey("ipv4:10.0.0.7:51234", std::nullopt));
  EXPECT_EQ(ClientKey("x", std::string(1000, 'n')), "name:" + std::string(128, 'n'));
}

}  // namespace
}  // namespace stance
