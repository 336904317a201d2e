"""What the providers of this folder share: the protocol, pictures, weights, and the parts of diffusion models."""
