// The border between the faces already coded and the rest of the mesh, as a set of vertex loops.
#pragma once

#include <cstdint>
#include <vector>

namespace rilievo {

// Element e is the half-edge of a coded face from vertex(e) to vertex(next(e)); across it lies a
// face not yet coded, or nothing. At every vertex on the border the two elements that meet there
// bound one gap of uncoded faces, so an edge with both faces coded always shows as two elements
// that follow each other back and forth, and can be zipped.
class MeshBorder {
 public:
  struct Element {
    int vertex;        // where it starts
    int next, prev;    // around the loop
    int apex;          // third vertex of its coded face
    int tag;           // the caller's own; an encoder keeps the half-edge here
    int live_index;    // place in the list of elements on the border, -1 once taken off
    bool is_boundary;  // nothing lies across
  };

  const Element& operator[](int e) const { return elements_[e]; }
  int size() const { return static_cast<int>(elements_.size()); }
  int End(int e) const { return elements_[elements_[e].next].vertex; }
  bool Live(int e) const { return elements_[e].live_index >= 0; }
  bool Open(int e) const { return Live(e) && !elements_[e].is_boundary; }
  const std::vector<int>& live() const { return live_; }

  // Whether the face across e may have the border's previous (next) vertex as its apex.
  bool CanCloseLeft(int e) const {
    return Open(elements_[e].prev) && elements_[e].prev != elements_[e].next;
  }
  bool CanCloseRight(int e) const {
    return Open(elements_[e].next) && elements_[e].prev != elements_[e].next;
  }

  // A loop of the three half-edges of face a, b, c, with their tags.
  void AddTriangle(int a, int b, int c, const int tags[3]);

  void MarkBoundary(int e) { elements_[e].is_boundary = true; }

  // Glue the face (end, start, apex) to element e = start -> end. `left_tag` belongs to its
  // half-edge start -> apex, `right_tag` to apex -> end. Each returns the element from where the
  // walk goes on, which may have been zipped at once.
  int GlueNewVertex(int e, int apex, int left_tag, int right_tag);
  int GlueLeft(int e, int right_tag);  // apex = start of prev(e)
  int GlueRight(int e, int left_tag);  // apex = end of next(e)
  // apex = start of `at`, somewhere on the border: splits a loop in two or joins two loops.
  int GlueAcross(int e, int at, int left_tag, int right_tag);

 private:
  int Add(int vertex, int apex, int tag);
  void Remove(int e);
  void Link(int first, int second) {
    elements_[first].next = second;
    elements_[second].prev = first;
  }
  // Takes off pairs u -> v -> u around e, as long as there are any.
  void Zip(int e);
  bool ZipPair(int first, int& before, int& after);

  std::vector<Element> elements_;
  std::vector<int> live_;
};

}  // namespace rilievo
