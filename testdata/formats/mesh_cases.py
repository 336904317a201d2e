"""Triangle meshes of other programs: glTF and OBJ."""

import base64
import json
import struct

from cases import invalid, valid
from image_cases import png
from splat_cases import f32, glb_file


def picture():
    """Four pixels: red, green, blue, white."""
    return png(2, 2, 2, 8, [b"\xff\0\0\0\xff\0", b"\0\0\xff\xff\xff\xff"])


def parts(change=None):
    corners = f32(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0)
    uvs = f32(0, 0, 1, 0, 1, 1, 0, 1)
    indices = struct.pack("<6H", 0, 1, 2, 0, 2, 3)
    image = picture()
    binary, views = b"", []
    for data in (corners, uvs, indices, image):
        binary += b"\0" * (-len(binary) % 4)
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        binary += data
    binary += b"\0" * (-len(binary) % 4)
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1, 2], "scale": [2, 2, 2]}, {"mesh": 0},
                  {"mesh": 0, "translation": [0, 0, 1], "rotation": [0, 1, 0, 0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2,
                                    "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}}],
        "textures": [{"source": 0}], "images": [{"bufferView": 3, "mimeType": "image/png"}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                      {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
                      {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "bufferViews": views, "buffers": [{"byteLength": len(binary)}]}
    if change:
        change(document)
    return document, binary


OBJ = """# a roof: colored vertices, a quad, relative numbers, flat and smooth
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 1 1 0 0 0 1
v 0 1 0 1 1 1
v 0.5 0.5 0.7
vt 0 0
vn 0 0 -1
f 4 3 2 1
s 1
f -5 -4 -1
f 2/1 3/1 5/1
s off
f 3//1 4//1 5//1
"""


def meshes():
    document, binary = parts()
    valid("meshes", "mesh.glb", glb_file(document, binary))
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + \
        base64.b64encode(binary).decode()
    valid("meshes", "mesh.gltf", json.dumps(document))
    valid("meshes", "mesh.obj", OBJ)

    def bad(name, expect, change):
        invalid("meshes", name + ".glb", expect, glb_file(*parts(change)))

    bad("child-twice", "do not form a tree", lambda d: d["nodes"][0].update(children=[1, 1]))
    bad("index-beyond", "names a vertex of 2", lambda d: d["accessors"][0].update(count=2))
    bad("image-beyond", "bufferView", lambda d: d["bufferViews"][3].update(byteLength=1 << 40))
    bad("picture-elsewhere", "leads out of the folder",
        lambda d: d["images"].__setitem__(0, {"uri": "../../images/v1/valid/a.png"}))
    bad("picture-fetched", "nothing is fetched",
        lambda d: d["images"].__setitem__(0, {"uri": "https://example.org/a.png"}))
    bad("draco", "KHR_draco_mesh_compression",
        lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"]))
    bad("no-triangles", "no triangles", lambda d: d["meshes"][0]["primitives"][0].update(mode=0))
    invalid("meshes", "corner-beyond.obj", "line 4", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")
    invalid("meshes", "infinite.obj", "line 1", "v 0 0 1e999\n")
    invalid("meshes", "library-elsewhere.obj", "leads out of the folder", "mtllib ../a.mtl\n")
