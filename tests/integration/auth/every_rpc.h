// Every RPC of the protocol, called by its name.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "google/protobuf/descriptor.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"
#include "rilievo/v1/jobs.pb.h"
#include "rilievo/v1/reconstruction.pb.h"

namespace rilievo {

// How a call of "/service/Method" with one message of these bytes ends.
inline grpc::Status CallByName(const std::shared_ptr<grpc::ChannelInterface>& channel,
                               const std::string& name, const std::string& message = "",
                               const std::string& authorization = "") {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
  if (!authorization.empty()) context.AddMetadata("authorization", authorization);
  grpc::CompletionQueue queue;
  const grpc::Slice bytes(message);
  const auto call = stub.PrepareUnaryCall(&context, name, grpc::ByteBuffer(&bytes, 1), &queue);
  call->StartCall();
  grpc::ByteBuffer response;
  grpc::Status status;
  call->Finish(&response, &status, nullptr);
  void* tag;
  bool ok;
  queue.Next(&tag, &ok);
  return status;
}

// By "/service/Method", of all of them.
inline std::map<std::string, grpc::Status> CallEveryRpc(
    const std::shared_ptr<grpc::ChannelInterface>& channel, const std::string& message = "",
    const std::string& authorization = "") {
  std::map<std::string, grpc::Status> ends;
  for (const auto* file : {v1::ReconstructRequest::descriptor()->file(),
                           v1::UploadScanRequest::descriptor()->file()}) {
    for (int s = 0; s < file->service_count(); ++s) {
      for (int m = 0; m < file->service(s)->method_count(); ++m) {
        const std::string name =
            "/" + file->service(s)->full_name() + "/" + file->service(s)->method(m)->name();
        ends[name] = CallByName(channel, name, message, authorization);
      }
    }
  }
  return ends;
}

}  // namespace rilievo
