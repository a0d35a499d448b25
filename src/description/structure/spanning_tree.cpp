// Which joints of a graph are its tree; the others close loops.
//
//     joints           a: 0 → 1,  b: 1 → 2,  c: 0 → 2,  d: 4 → 3,  e: 3 → 4,  f: 2 → 3
//     first choice     1: a,  2: b,  3: d,  4: e           of joints with one child the first that is preferred, or the first
//     from the root    0 ─a→ 1 ─b→ 2                        3 and 4 carry each other, and no root leads there
//     over others      3: f, and with it 4 by e             the first joint of the file that leads on, again and again
//     loops            c, d
//
// So a joint keeps its place in the tree unless a link would be cut off by it.
#include "description/structure/loops.hpp"

#include <functional>
#include <queue>

namespace ksl {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// Grows the tree from links that are in it, over joints that have been chosen, and collects the others that leave it.
class growth {
public:
  growth(const std::vector<std::pair<int, int>> &joints, std::vector<int> &chosen)
      : joints_(joints), chosen_(chosen), reached_(chosen.size(), false), leaving_(chosen.size()) {
    for (std::size_t j = 0; j < joints.size(); ++j)
      leaving_[index(joints[j].first)].push_back(static_cast<int>(j));
  }

  void from(int link) {
    for (std::vector<int> pending = {link}; !pending.empty();) {
      const int l = pending.back();
      pending.pop_back();
      if (reached_[index(l)])
        continue;
      reached_[index(l)] = true;
      for (const int j : leaving_[index(l)]) {
        const int child = joints_[index(j)].second;
        if (chosen_[index(child)] == j)
          pending.push_back(child);
        else
          others_.push(j);
      }
    }
  }

  /// Links that aren't reached, but could be over other joints, take the first of these instead.
  void over_others() {
    while (!others_.empty()) {
      const int j = others_.top(), child = joints_[index(j)].second;
      others_.pop();
      if (reached_[index(child)])
        continue;
      chosen_[index(child)] = j;
      from(child);
    }
  }

private:
  const std::vector<std::pair<int, int>> &joints_;
  std::vector<int> &chosen_; ///< the joint that carries each link
  std::vector<bool> reached_;
  std::vector<std::vector<int>> leaving_;
  std::priority_queue<int, std::vector<int>, std::greater<>> others_; ///< the first of the file comes first
};

} // namespace

std::vector<bool> spanning_tree(std::size_t links, const std::vector<std::pair<int, int>> &joints,
                                const std::vector<bool> &preferred) {
  std::vector<int> chosen(links, -1);
  for (std::size_t j = 0; j < joints.size(); ++j)
    if (int &joint = chosen[index(joints[j].second)];
        joint < 0 || (!preferred.empty() && preferred[j] && !preferred[index(joint)]))
      joint = static_cast<int>(j);
  growth tree(joints, chosen);
  for (std::size_t l = 0; l < links; ++l)
    if (chosen[l] < 0)
      tree.from(static_cast<int>(l));
  tree.over_others();
  std::vector<bool> in_tree(joints.size(), false);
  for (const int j : chosen)
    if (j >= 0)
      in_tree[index(j)] = true;
  return in_tree;
}

} // namespace ksl
