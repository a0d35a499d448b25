// How many cores the process may use.
#pragma once

#include <cstddef>
#include <string_view>

namespace ksl {

/// The number of cores that the process may use: the least of the machine's cores, of those that it may run on (sched_setaffinity,
/// taskset), and of those that the quotas of its control groups allow, rounded up.  At least 1.  Asks the system; allocates nothing.
std::size_t cores_of_process() noexcept;

/// The number of cores that a quota of processor time allows, from the contents of files of a control group; 0 if there is no limit, or
/// if it isn't understood.
/// cpu_max: "max 100000" or "150000 100000" (version 2).  quota and period: "-1" or "150000", "100000" (version 1).
std::size_t cores_of_cpu_max(std::string_view cpu_max) noexcept;
std::size_t cores_of_quota(std::string_view quota, std::string_view period) noexcept;

/// The path of a process in a hierarchy of control groups, from the contents of /proc/self/cgroup: with "cpu" that of the controller in
/// version 1, with "" that of version 2.  Empty: none.
std::string_view path_of_group(std::string_view groups, std::string_view controller) noexcept;

/// The least quota of the groups in such contents, and of those that they are in, in cores; 0: none.  Their files are
/// read from the hierarchies in the folder mounted_at, as /sys/fs/cgroup.
std::size_t quota_of_groups(std::string_view groups, const char *mounted_at) noexcept;

} // namespace ksl
