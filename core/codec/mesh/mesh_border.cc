#include "core/codec/mesh/mesh_border.h"

namespace rilievo {

int MeshBorder::Add(int vertex, int apex, int tag) {
  const int e = size();
  elements_.push_back({vertex, -1, -1, apex, tag, static_cast<int>(live_.size()), false});
  live_.push_back(e);
  return e;
}

void MeshBorder::Remove(int e) {
  const int place = elements_[e].live_index;
  live_[place] = live_.back();
  elements_[live_[place]].live_index = place;
  live_.pop_back();
  elements_[e].live_index = -1;
}

void MeshBorder::AddTriangle(int a, int b, int c, const int tags[3]) {
  const int first = Add(a, c, tags[0]);
  const int second = Add(b, a, tags[1]);
  const int third = Add(c, b, tags[2]);
  Link(first, second);
  Link(second, third);
  Link(third, first);
}

int MeshBorder::GlueNewVertex(int e, int apex, int left_tag, int right_tag) {
  const int start = elements_[e].vertex, end = End(e);
  const int before = elements_[e].prev, after = elements_[e].next;
  const int left = Add(start, end, left_tag);
  const int right = Add(apex, start, right_tag);
  Link(before, left);
  Link(left, right);
  Link(right, after);
  Remove(e);
  return left;
}

int MeshBorder::GlueLeft(int e, int right_tag) {
  const int start = elements_[e].vertex;
  const int left = elements_[e].prev;
  const int before = elements_[left].prev, after = elements_[e].next;
  const int right = Add(elements_[left].vertex, start, right_tag);
  Link(before, right);
  Link(right, after);
  Remove(e);
  Remove(left);
  Zip(right);
  return right;
}

int MeshBorder::GlueRight(int e, int left_tag) {
  const int end = End(e);
  const int right = elements_[e].next;
  const int before = elements_[e].prev, after = elements_[right].next;
  const int left = Add(elements_[e].vertex, end, left_tag);
  Link(before, left);
  Link(left, after);
  Remove(e);
  Remove(right);
  Zip(left);
  return left;
}

int MeshBorder::GlueAcross(int e, int at, int left_tag, int right_tag) {
  const int start = elements_[e].vertex, end = End(e);
  const int before = elements_[e].prev, after = elements_[e].next;
  const int before_at = elements_[at].prev;
  const int left = Add(start, end, left_tag);
  const int right = Add(elements_[at].vertex, start, right_tag);
  Link(before, left);
  Link(left, at);
  Link(before_at, right);
  Link(right, after);
  Remove(e);
  Zip(left);
  if (Live(right)) Zip(right);
  return left;
}

bool MeshBorder::ZipPair(int first, int& before, int& after) {
  const int second = elements_[first].next;
  if (!Open(first) || !Open(second) || second == first) return false;
  if (elements_[elements_[second].next].vertex != elements_[first].vertex) return false;
  before = elements_[first].prev;
  after = elements_[second].next;
  Remove(first);
  Remove(second);
  if (before == second) {  // the loop was this pair
    before = after = -1;
    return true;
  }
  Link(before, after);
  return true;
}

void MeshBorder::Zip(int e) {
  int before = -1, after = -1;
  if (!ZipPair(e, before, after) && !ZipPair(elements_[e].prev, before, after)) return;
  while (before >= 0 && ZipPair(before, before, after)) {
  }
}

}  // namespace rilievo
