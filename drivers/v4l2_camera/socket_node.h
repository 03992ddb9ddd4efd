// A video device behind a socket, for tests and for rigs without a camera: whoever listens plays the kernel.
// It is an AF_UNIX socket of type SOCK_SEQPACKET, and each request is one packet that is answered by one.
//
//   CODE ARGUMENT       an ioctl: its number (32 bits) and its structure as <linux/videodev2.h> has it.
//                       Answered by ERRNO (32 bits, 0: done) and the structure as it is afterwards.
//   0 OFFSET LENGTH     (32 bits each) a mapping. Answered by ERRNO and, where that is 0, a descriptor of
//                       memory that is mapped from its beginning.
//
// Numbers are in this machine's order. The device is closed when the connection ends; one that hangs up was
// unplugged.
#pragma once

#include <memory>
#include <string>

#include "drivers/v4l2_camera/video_node.h"

namespace rig::drivers::v4l2 {

[[nodiscard]] base::Result<std::unique_ptr<VideoNode>> open_socket_node(const std::string& path);

}  // namespace rig::drivers::v4l2
