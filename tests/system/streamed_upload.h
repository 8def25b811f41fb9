#pragma once

#include <functional>

#include "tests/system/nifti_bytes.h"
#include "tests/system/service_client.h"

namespace volsmooth::test {

using Slice = std::vector<std::int16_t>;

/// Uploads a volume of 1 mm voxels as its slices are made, each of `size[0] * size[1]` voxels; the answer's
/// document.
inline json streamed_upload(const Daemon& daemon, const std::array<int, 3>& size,
                            const std::function<Slice(int z)>& make_slice) {
  const Bytes header = make_nifti1<std::int16_t>({size[0], size[1], size[2]}, {1, 1, 1}, {});
  std::size_t length = sizeof(std::int16_t);
  for (const int along : size) length *= static_cast<std::size_t>(along);
  HttpConnection connection(daemon.port());
  connection.set_patience(600);
  connection.send("POST /v1/volumes HTTP/1.1\r\nHost: localhost\r\nContent-Length: " +
                  std::to_string(header.size() + length) + "\r\n\r\n" + header);
  for (int z = 0; z < size[2]; ++z) {
    const Slice slice = make_slice(z);
    if (!connection.send({reinterpret_cast<const char*>(slice.data()), slice.size() * sizeof slice[0]}))
      throw std::runtime_error("the upload was cut off");
  }
  const auto answer = connection.read();
  if (!answer || answer->status != 201) throw std::runtime_error("the upload was refused");
  return answer->document();
}

}  // namespace volsmooth::test
