// Sends one Transfer of two large meshes to HOST:PORT and waits for the answer: a client that a test can
// kill.

#include <grpcpp/grpcpp.h>

#include <cstdio>

#include "proto/wire/mesh_wire.h"
#include "stance/v1/pose_transfer.grpc.pb.h"
#include "tests/support/meshes.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  auto stub = stance::v1::PoseTransferService::NewStub(
      grpc::CreateChannel(argv[1], grpc::InsecureChannelCredentials()));
  stance::v1::TransferRequest request;
  stance::MeshToArrays(stance::testing::Icosphere(6), request.mutable_source()->mutable_arrays());
  *request.mutable_reference() = request.source();
  stance::v1::TransferResponse response;
  grpc::ClientContext context;
  const grpc::Status status = stub->Transfer(&context, request, &response);
  std::printf("%d\n", status.error_code());
  return status.ok() ? 0 : 1;
}
