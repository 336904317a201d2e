"""Weights that are not what they should be. Standard library only."""

import json
import os
import struct
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from provider_kit import weights  # noqa: E402
from provider_kit.protocol import BadInput  # noqa: E402


def safetensors(tensors, tail=b""):
    """The bytes of a file with zeros in tensors of these types and shapes."""
    head, at = {}, 0
    for name, (kind, shape) in tensors.items():
        size = weights.SIZES[kind]
        for side in shape:
            size *= side
        head[name] = {"dtype": kind, "shape": shape, "data_offsets": [at, at + size]}
        at += size
    text = json.dumps(head).encode()
    return struct.pack("<Q", len(text)) + text + bytes(at) + tail


class Weights(unittest.TestCase):
    """Each bad file is one error that names it and says what to do."""

    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = Path(temporary.name)
        caches = mock.patch.dict(os.environ, {"XDG_CACHE_HOME": str(self.folder / "cache")})
        caches.start()
        self.addCleanup(caches.stop)

    def file(self, content, name="w.safetensors"):
        """A file with this content."""
        path = self.folder / name
        path.write_bytes(content)
        return path

    def assert_says(self, text, call, *arguments):
        """The call fails with this text and a remedy."""
        with self.assertRaises(BadInput) as caught:
            call(*arguments)
        self.assertIn(text, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))
        self.assertTrue(caught.exception.remedy)
        self.assertEqual(caught.exception.exit_code, 3)

    def test_a_whole_file_tells_types_and_shapes(self):
        path = self.file(safetensors({"a": ("F16", [2, 3]), "b": ("BF16", [4])}))
        self.assertEqual(weights.header(path), {"a": ("F16", (2, 3)), "b": ("BF16", (4,))})

    def test_a_header_of_any_length_is_no_pickle(self):
        text = json.dumps({"a": {"dtype": "U8", "shape": [1], "data_offsets": [0, 1]}}).ljust(0x280).encode()
        path = self.file(struct.pack("<Q", len(text)) + text + b"0")
        self.assertEqual(weights.header(path), {"a": ("U8", (1,))})

    def test_files_that_are_cut_short_or_no_safetensors_are_said(self):
        whole = safetensors({"a": ("F32", [64])})
        for cut in (0, 4, 8, 20, len(whole) - 1):
            self.assert_says("cut short", weights.header, self.file(whole[:cut]))
        self.assert_says("has a tail", weights.header, self.file(whole + b"x"))
        self.assert_says("no safetensors file", weights.header, self.file(struct.pack("<Q", 20) + b"x" * 40))
        self.assert_says("no tensors", weights.header, self.file(safetensors({})))
        self.assert_says("could run code", weights.header, self.file(b"PK\x03\x04" + bytes(100), "w.ckpt"))
        self.assert_says("could run code", weights.header, self.file(b"\x80\x02" + bytes(100), "w.pt"))
        self.assert_says("Git LFS", weights.header, self.file(b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n"))
        self.assert_says("a folder where a file is due", weights.header, self.folder)
        odd = json.dumps({"a": {"dtype": "F32", "shape": [1]}}).encode()
        self.assert_says("no safetensors file", weights.header, self.file(struct.pack("<Q", len(odd)) + odd))

    def test_weights_of_another_model_are_said(self):
        wanted = {"conv_in.weight": (4, 8), "b": (1,), "c": (2,)}
        weights.compare(dict(wanted), wanted, "w", "the UNet")
        self.assert_says("b and 1 more of the UNet missing", weights.compare, {"conv_in.weight": (4, 8)}, wanted, "w", "the UNet")
        self.assert_says("d not of the UNet", weights.compare, {**wanted, "d": (1,)}, wanted, "w", "the UNet")
        self.assert_says("conv_in.weight is 4x12, the UNet has 4x8", weights.compare, {**wanted, "conv_in.weight": (4, 12)}, wanted, "w", "the UNet")
        self.assert_says("before diffusers", weights.compare, {"model.diffusion_model.a": (1,)}, wanted, "w", "the UNet")

    def test_a_folder_of_a_model_has_its_parts(self):
        self.assert_says("a file where the folder", weights.part, self.file(b"x"), "unet")
        self.assert_says("no unet of a model", weights.part, self.folder, "unet")
        place = self.folder / "unet"
        place.mkdir()
        (place / "config.json").write_text("{", encoding="utf-8")
        self.assert_says("config.json cannot be read", weights.part, self.folder, "unet")
        (place / "config.json").write_text('{"in_channels": 4}', encoding="utf-8")
        (place / "diffusion_pytorch_model.bin").write_bytes(b"x")
        self.assert_says("no weights in safetensors", weights.part, self.folder, "unet")
        (place / "model.safetensors").write_bytes(b"x")
        self.assertEqual(weights.part(self.folder, "unet"), (place / "model.safetensors", {"in_channels": 4}))

    def test_missing_weights_name_their_source_and_license(self):
        with mock.patch.dict(os.environ):
            os.environ.pop(weights.MODELS_VARIABLE, None)
            self.assert_says("--model is not given", weights.located, None, "instruct-pix2pix", "--model")
            self.assert_says("no such file", weights.located, "/no/such", "instruct-pix2pix", "--model")
            os.environ[weights.MODELS_VARIABLE] = str(self.folder)
            (self.folder / "ic-light").mkdir()
            self.assertEqual(weights.located(None, "ic-light", "--weights"), self.folder / "ic-light")
        for name, (place, license_name) in weights.SOURCES.items():
            self.assertIn(license_name, weights.source(name))
            self.assertTrue(place and weights.license_of(name))

    def test_digests_are_kept_until_the_file_changes(self):
        path = self.file(b"abc")
        first = weights.sha256_of(path)
        self.assertEqual(first, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad")
        with mock.patch.object(weights.hashlib, "sha256", side_effect=AssertionError("read again")):
            self.assertEqual(weights.sha256_of(path), first)
        path.write_bytes(b"abcd")
        self.assertNotEqual(weights.sha256_of(path), first)
        weights.digests_file().write_text("[", encoding="utf-8")
        self.assertEqual(weights.sha256_of(self.file(b"abc", "again")), first)


if __name__ == "__main__":
    unittest.main()
