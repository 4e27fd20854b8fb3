#include "server/access/token_gate.h"

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace stance {
namespace {

using Verdict = Admission::Verdict;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr TimePoint kStart = TimePoint(std::chrono::hours(5));

TokenClient Client(const std::string& name, const std::vector<std::string>& tokens,
                   std::optional<double> requests = std::nullopt,
                   std::optional<double> vertices = std::nullopt) {
  TokenClient client;
  client.name = name;
  for (const std::string& token : tokens) client.tokens.push_back(Sha256(token));
  client.requests_per_second = requests;
  client.vertices_per_second = vertices;
  return client;
}

TEST(TokenGateTest, IsOpenUntilItHasClients) {
  TokenGate gate;
  EXPECT_EQ(gate.Admit(std::nullopt, 1000, kStart).verdict, Verdict::kAdmitted);
  gate.Replace({Client("studio", {"alpha"})});
  EXPECT_EQ(gate.Admit(std::nullopt, 1000, kStart).verdict, Verdict::kNoToken);
}

TEST(TokenGateTest, KnowsAClientByItsTokens) {
  TokenGate gate;
  gate.Replace({Client("studio", {"alpha", "beta"}), Client("lab", {"gamma"})});
  EXPECT_EQ(gate.Admit("Bearer alpha", 1, kStart).client, "studio");
  EXPECT_EQ(gate.Admit("bearer beta", 1, kStart).client, "studio");
  EXPECT_EQ(gate.Admit("BEARER gamma", 1, kStart).client, "lab");
}

TEST(TokenGateTest, TellsWhoMayAdminister) {
  TokenGate gate;
  EXPECT_TRUE(gate.Admit(std::nullopt, 0, kStart).admin) << "there are no tokens";
  std::vector<TokenClient> clients = {Client("studio", {"alpha"}), Client("ops", {"beta"})};
  clients[1].admin = true;
  gate.Replace(clients);
  EXPECT_FALSE(gate.Admit("Bearer alpha", 0, kStart).admin);
  EXPECT_TRUE(gate.Admit("Bearer beta", 0, kStart).admin);
  EXPECT_FALSE(gate.Admit("Bearer gamma", 0, kStart).admin);
  EXPECT_FALSE(gate.Admit(std::nullopt, 0, kStart).admin);
}

TEST(TokenGateTest, RefusesEverythingElse) {
  TokenGate gate;
  gate.Replace({Client("studio", {"alpha"})});
  for (const char* authorization : {"", "alpha", "Bearer", "Bearer ", "Basic alpha", "Beareralpha"}) {
    EXPECT_EQ(gate.Admit(authorization, 1, kStart).verdict, Verdict::kNoToken) << authorization;
  }
  for (const char* authorization :
       {"Bearer alph", "Bearer alpha ", "Bearer  alpha", "Bearer Alpha", "Bearer alphaa"}) {
    const Admission admission = gate.Admit(authorization, 1, kStart);
    EXPECT_EQ(admission.verdict, Verdict::kUnknownToken) << authorization;
    EXPECT_EQ(admission.client, "");
  }
  // The digest is not the token.
  EXPECT_EQ(gate.Admit("Bearer 8ed3f6ad685b959ead7022518e1af76cd816f8e8ec7ccdda1ed4018e8f2223f8", 1, kStart)
                .verdict,
            Verdict::kUnknownToken);
}

TEST(TokenGateTest, OverQuotaSaysWhichAndUntilWhen) {
  TokenGate gate;
  gate.Replace({Client("studio", {"alpha"}, 2, 1000)});
  EXPECT_EQ(gate.Admit("Bearer alpha", 100, kStart).verdict, Verdict::kAdmitted);
  EXPECT_EQ(gate.Admit("Bearer alpha", 100, kStart).verdict, Verdict::kAdmitted);
  Admission refused = gate.Admit("Bearer alpha", 100, kStart);
  EXPECT_EQ(refused.verdict, Verdict::kRequests);
  EXPECT_EQ(refused.retry_after, milliseconds(500));
  EXPECT_EQ(refused.client, "studio");
  EXPECT_EQ(gate.Admit("Bearer alpha", 5000, kStart + seconds(10)).verdict, Verdict::kAdmitted);
  refused = gate.Admit("Bearer alpha", 500, kStart + seconds(10));
  EXPECT_EQ(refused.verdict, Verdict::kVertices);
  EXPECT_EQ(refused.retry_after, milliseconds(4500));
  EXPECT_EQ(gate.Admit("Bearer alpha", 500, kStart + milliseconds(14'499)).verdict, Verdict::kVertices);
  EXPECT_EQ(gate.Admit("Bearer alpha", 500, kStart + milliseconds(14'500)).verdict, Verdict::kAdmitted);
}

TEST(TokenGateTest, WhatHasNoVerticesPassesWhateverIsOwed) {
  TokenGate gate;
  gate.Replace({Client("studio", {"alpha"}, std::nullopt, 10)});
  EXPECT_EQ(gate.Admit("Bearer alpha", 5000, kStart).verdict, Verdict::kAdmitted);
  EXPECT_EQ(gate.Admit("Bearer alpha", 1, kStart).verdict, Verdict::kVertices);
  EXPECT_EQ(gate.Admit("Bearer alpha", 0, kStart).verdict, Verdict::kAdmitted);
}

TEST(TokenGateTest, ARefusalCostsNothing) {
  TokenGate patient, hammered;
  for (TokenGate* gate : {&patient, &hammered}) gate->Replace({Client("studio", {"alpha"}, 3, 1000)});
  Random random(4);
  TimePoint now = kStart;
  for (int i = 0; i < 500; ++i) {
    now += milliseconds(random.Below(400));
    const int64_t vertices = random.Below(800);
    const Admission alone = patient.Admit("Bearer alpha", vertices, now);
    const Admission first = hammered.Admit("Bearer alpha", vertices, now);
    ASSERT_EQ(first.verdict, alone.verdict) << i;
    if (first.verdict == Verdict::kAdmitted) continue;
    for (int again = 0; again < 3; ++again) {
      ASSERT_EQ(hammered.Admit("Bearer alpha", vertices, now).retry_after, alone.retry_after);
      hammered.Admit("Bearer wrong", vertices, now);
    }
  }
}

TEST(TokenGateTest, OneClientsQuotaIsNotAnothers) {
  TokenGate gate;
  gate.Replace(
      {Client("studio", {"alpha", "beta"}, 1), Client("lab", {"gamma"}, 1), Client("own", {"delta"})});
  EXPECT_EQ(gate.Admit("Bearer alpha", 1, kStart).verdict, Verdict::kAdmitted);
  EXPECT_EQ(gate.Admit("Bearer beta", 1, kStart).verdict, Verdict::kRequests);
  EXPECT_EQ(gate.Admit("Bearer gamma", 1, kStart).verdict, Verdict::kAdmitted);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(gate.Admit("Bearer delta", 1'000'000, kStart).verdict, Verdict::kAdmitted);
  }
}

TEST(TokenGateTest, AReplacementKeepsWhatWasUsedUnlessTheRateChanged) {
  TokenGate gate;
  gate.Replace({Client("studio", {"alpha"}, 1, 1000)});
  EXPECT_EQ(gate.Admit("Bearer alpha", 1, kStart).verdict, Verdict::kAdmitted);
  gate.Replace({Client("lab", {"gamma"}), Client("studio", {"beta"}, 1, 1000)});
  EXPECT_EQ(gate.Admit("Bearer alpha", 1, kStart).verdict, Verdict::kUnknownToken);
  EXPECT_EQ(gate.Admit("Bearer beta", 1, kStart).verdict, Verdict::kRequests);
  gate.Replace({Client("studio", {"beta"}, 2, 1000)});
  EXPECT_EQ(gate.Admit("Bearer beta", 1, kStart).verdict, Verdict::kAdmitted);
}

}  // namespace
}  // namespace stance
