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

// By "/service/Method": how a call with one empty message ends.
inline std::map<std::string, grpc::Status> CallEveryRpc(
    const std::shared_ptr<grpc::ChannelInterface>& channel) {
  std::map<std::string, grpc::Status> ends;
  grpc::GenericStub stub(channel);
  for (const auto* file : {v1::ReconstructRequest::descriptor()->file(),
                           v1::UploadScanRequest::descriptor()->file()}) {
    for (int s = 0; s < file->service_count(); ++s) {
      for (int m = 0; m < file->service(s)->method_count(); ++m) {
        const std::string name =
            "/" + file->service(s)->full_name() + "/" + file->service(s)->method(m)->name();
        grpc::ClientContext context;
        context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
        grpc::CompletionQueue queue;
        const grpc::Slice empty;
        const auto call =
            stub.PrepareUnaryCall(&context, name, grpc::ByteBuffer(&empty, 1), &queue);
        call->StartCall();
        grpc::ByteBuffer response;
        call->Finish(&response, &ends[name], nullptr);
        void* tag;
        bool ok;
        queue.Next(&tag, &ok);
      }
    }
  }
  return ends;
}

}  // namespace rilievo
