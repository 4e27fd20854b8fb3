// The C library's allocator, tuned for networks.
#pragma once

namespace stance {

// Has this process keep up to 1 GiB of freed memory. A pass through a network allocates and frees the same
// hundreds of megabytes; returned to the kernel and faulted in again they cost a tenth of its time. For a
// program's main(); does nothing where the allocator isn't glibc's.
void KeepFreedMemory();

}  // namespace stance
