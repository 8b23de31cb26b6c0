"""Neural models, one file each, found by their decorator."""

# Imported by every module here; looked for, and not imported, when models are only listed.
REQUIRES = ("torch", "safetensors")
