#include <peat/base/archive.h>

#include <peat/base/error.h>

#include <istream>
#include <ostream>

namespace peat {
void Archive::bytes(void *data, const std::size_t n)
{
  if (out) {
    out->write(static_cast<const char *>(data), n);
    return;
  }
  in->read(static_cast<char *>(data), n);
  if (std::size_t(in->gcount()) != n)
    throw InputError("the checkpoint ends too early for this program");
}

void Archive::take(std::string &text, int)
{
  std::uint64_t n = text.size();
  bytes(&n, sizeof(n));
  constexpr std::uint64_t longest = 1 << 20;
  if (n > longest)
    throw InputError("the checkpoint was written by another program: a text in it is too long");
  text.resize(n);
  bytes(&text[0], n);
}

void Archive::begin(const std::string &name)
{
  std::string found = name;
  take(found, 0);
  if (found != name)
    throw InputError("the checkpoint was written by another program: '" + found + "' stands where '" + name +
                     "' is expected");
}
} // namespace peat
