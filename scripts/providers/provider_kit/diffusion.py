"""What IC-Light and InstructPix2Pix share: pictures to latents and back, texts to embeddings, noise by seed. Needs torch."""

import math

import numpy as np
import torch

from . import loading
from .protocol import BadRequest

# Chunks of 75 tokens: a longer text says nothing that a model trained on 75 would follow.
MOST_CHUNKS = 8


class Parts:
    """Autoencoder, text encoder and tokenizer of a folder; UNets are loaded beside it."""

    def __init__(self, folder, options):
        self.device, self.dtype = loading.device_of(options)
        self.tokenizer = loading.tokenizer(folder)
        self.text_encoder = loading.text_encoder(folder).to(self.device)
        # 16 bits overflow in this network.
        self.vae = loading.vae(folder).to(self.device)

    @property
    def scale(self):
        """Latents are multiplied by it for the UNet."""
        return self.vae.config.scaling_factor

    @property
    def factor(self):
        """Pixels per latent pixel."""
        return 2 ** (len(self.vae.config.block_out_channels) - 1)

    def placed(self, network):
        """A network on the device, in its precision."""
        return network.to(self.device, self.dtype)

    @torch.inference_mode()
    def encoded(self, pixels):
        """The mode of the latents of pixels, -1 to 1, pictures x 3 x height x width; not scaled."""
        return torch.cat([self.vae.encode(p[None].to(self.device)).latent_dist.mode() for p in pixels])

    @torch.inference_mode()
    def decoded(self, latents):
        """Pixels, about -1 to 1, of scaled latents."""
        return torch.cat([self.vae.decode(z[None].float() / self.scale).sample for z in latents])

    def noise(self, seed, count, size, like=0):
        """Normal noise of a seed, for pictures of `size` (width, height): the same on every device. `like` numbers further draws."""
        generator = torch.Generator("cpu").manual_seed((seed + 0x9E3779B97F4A7C15 * like) % (1 << 63))
        shape = (count, self.vae.config.latent_channels, size[1] // self.factor, size[0] // self.factor)
        return torch.randn(shape, generator=generator).to(self.device)

    def tokens(self, text):
        """Token numbers of a text without the marks of its ends."""
        return self.tokenizer(text, truncation=False, add_special_tokens=False, verbose=False)["input_ids"]

    @torch.inference_mode()
    def chunks(self, text):
        """Embeddings of a text of any length: chunks x 77 x channels, each chunk filled with the end mark."""
        longest = self.tokenizer.model_max_length
        tokens, inner = self.tokens(text), longest - 2
        count = max(1, math.ceil(len(tokens) / inner))
        if count > MOST_CHUNKS:
            raise BadRequest(f"the prompt has {len(tokens)} tokens; the model takes {MOST_CHUNKS * inner}", "shorten the prompt")
        begin, end = self.tokenizer.bos_token_id, self.tokenizer.eos_token_id
        rows = [[begin, *tokens[i * inner:(i + 1) * inner], end] for i in range(count)]
        rows = [row + [end] * (longest - len(row)) for row in rows]
        return self.text_encoder(torch.tensor(rows, device=self.device)).last_hidden_state

    def embedded_pair(self, prompt, negative):
        """Embeddings of two texts as one sequence each, of the same length: chunks are repeated."""
        pair = [self.chunks(prompt), self.chunks(negative)]
        count = max(len(c) for c in pair)
        pair = [torch.cat([c] * math.ceil(count / len(c)))[:count] for c in pair]
        return [c.reshape(1, -1, c.shape[-1]).to(self.dtype) for c in pair]

    @torch.inference_mode()
    def embedded(self, text):
        """Embedding of a text that fits: 1 x 77 x channels, filled as the tokenizer fills."""
        longest, tokens = self.tokenizer.model_max_length, self.tokens(text)
        if len(tokens) > longest - 2:
            raise BadRequest(f"the prompt has {len(tokens)} tokens, the model reads {longest - 2}", "shorten the prompt")
        filled = self.tokenizer(text, padding="max_length", max_length=longest, return_tensors="pt")
        return self.text_encoder(filled.input_ids.to(self.device)).last_hidden_state.to(self.dtype)


def signed(pixels, middle=127.5):
    """Bytes, height x width x 3, as numbers around 0, 3 x height x width; `middle` becomes 0."""
    values = torch.from_numpy(np.array(pixels, dtype=np.float32))
    return (values / middle - 1.0).movedim(-1, 0)


def unsigned(values):
    """Numbers from -1 to 1, 3 x height x width, as bytes, height x width x 3."""
    values = (values.float() * 127.5 + 127.5).clamp(0, 255)
    return torch.nan_to_num(values).round().to(torch.uint8).movedim(0, -1).cpu().numpy()
