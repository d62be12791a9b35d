#pragma once

#include <array>
#include <cstdint>
#include <iosfwd>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

namespace peat {
/// Writes what a run must remember to a stream, or reads it back. A class that lives longer than a step lists
/// its memory once, for both ways:
///
///   void Thing::persist(Archive &archive)
///   {
///     archive.begin("thing");
///     archive(count, values, parts);
///   }
///
/// Numbers, enumerations and trivially copyable structures (without pointers) go as they are in memory, so
/// that what is read is what was written in every bit, and only the program that wrote it can read it.
/// Strings, vectors, arrays, maps and everything that has persist() are taken apart.
class Archive
{
public:
  explicit Archive(std::ostream &out) : out(&out) {}
  explicit Archive(std::istream &in) : in(&in) {}

  bool is_loading() const { return in != nullptr; }

  /// What follows belongs to `name`. Throws an InputError if something else was written here.
  void begin(const std::string &name);

  template <typename... Values>
  void operator()(Values &...values)
  {
    (take(values, 0), ...);
  }

  /// Throws an InputError at the end of what there is.
  void bytes(void *data, std::size_t n);

private:
  // What has persist() comes first.
  template <typename Value>
  auto take(Value &value, int) -> decltype(value.persist(*this))
  {
    value.persist(*this);
  }
  template <typename Value>
  void take(Value &value, long)
  {
    static_assert(std::is_trivially_copyable<Value>::value && !std::is_pointer<Value>::value,
                  "give the class a function persist(Archive &)");
    bytes(&value, sizeof(Value));
  }
  void take(std::string &text, int);
  template <typename Value>
  void take(std::vector<Value> &list, int)
  {
    std::uint64_t n = list.size();
    bytes(&n, sizeof(n));
    if (is_loading())
      list.resize(n);
    if constexpr (std::is_arithmetic<Value>::value)
      bytes(list.data(), n * sizeof(Value));
    else
      for (Value &value : list)
        take(value, 0);
  }
  template <typename Value, std::size_t n>
  void take(std::array<Value, n> &list, int)
  {
    for (Value &value : list)
      take(value, 0);
  }
  template <typename Key, typename Value>
  void take(std::map<Key, Value> &map, int)
  {
    std::uint64_t n = map.size();
    bytes(&n, sizeof(n));
    if (is_loading()) {
      map.clear();
      for (std::uint64_t i = 0; i < n; ++i) {
        Key key;
        take(key, 0);
        take(map[key], 0);
      }
    } else
      for (auto &[name, value] : map) {
        Key key = name;
        take(key, 0);
        take(value, 0);
      }
  }

  std::ostream *const out = nullptr;
  std::istream *const in = nullptr;
};
} // namespace peat
