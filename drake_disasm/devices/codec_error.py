"""The one exception of the codecs."""

from drake_disasm.common.errors import DisasmError


class CodecError(DisasmError):
    """Something is no packet of the protocol, or can't be said in it."""
