#!/usr/bin/env python3
"""Write LPIPS weights of your own torchvision and lpips install to one safetensors file.

    python3 scripts/export-lpips.py --net alex -o lpips-alex.safetensors
    target/release/evaluate ... --lpips-weights lpips-alex.safetensors --lpips-net alex

Needs the Python packages torch, torchvision, lpips and safetensors. torchvision fetches the
weights of the classification network the first time it is asked for them; their license and the
license of the lpips package apply to the file. motes itself ships no weights and fetches none.

Tensors in the file, all 32-bit floats:
    features.N.weight  [out, in, k, k]   convolution N of torchvision's `features`
    features.N.bias    [out]
    linK.weight        [1, channels, 1, 1]   weights of tap K of the lpips package, version 0.1
"""

import argparse
import sys


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", choices=["alex", "vgg"], default="alex")
    parser.add_argument("-o", "--output", required=True, metavar="FILE.safetensors")
    args = parser.parse_args()

    try:
        import lpips
        import torch
        import torchvision
        from safetensors.torch import save_file
    except ImportError as missing:
        print(f"export-lpips: {missing}", file=sys.stderr)
        print("help: pip install torch torchvision lpips safetensors", file=sys.stderr)
        return 1

    if args.net == "alex":
        network = torchvision.models.alexnet(weights="IMAGENET1K_V1")
    else:
        network = torchvision.models.vgg16(weights="IMAGENET1K_V1")
    # pnet_rand: the classification weights come from torchvision above, so lpips need not load
    # them a second time; its own linear weights are read from its package.
    metric = lpips.LPIPS(net=args.net, version="0.1", pnet_rand=True, verbose=False)

    tensors = {
        f"features.{name}": value.detach().to(torch.float32).contiguous()
        for name, value in network.features.state_dict().items()
    }
    for k, linear in enumerate(metric.lins):
        weight = linear.model[-1].weight.detach().to(torch.float32).contiguous()
        tensors[f"lin{k}.weight"] = weight
    metadata = {
        "net": args.net,
        "torchvision": torchvision.__version__,
        "lpips": getattr(lpips, "__version__", "unknown"),
    }
    save_file(tensors, args.output, metadata=metadata)
    print(f"export-lpips: wrote {len(tensors)} tensors to {args.output}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
