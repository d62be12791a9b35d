#pragma once

#include <peat/base/error.h>

namespace peat {
/// The value of an entry is wrong whatever the rest of the file says: a word that is none of the choices, a
/// number out of range.
class InvalidValue : public InputError
{
public:
  using InputError::InputError;
};
} // namespace peat
