"""Writes a scene as one binary glTF 2.0 file, the same bytes every time.

Numbers are radiometric: `radiance` is that of a Lambertian emitter's front, `intensity` is radiant intensity, `irradiance` is that of
a plane which faces a directional light.
"""

import json
import math
import struct

from .vec import frame

DIFFUSE = {"KHR_materials_specular": {"specularFactor": 0.0}}


def rounded(values, digits=6):
    """Plain numbers for JSON: no negative zero, no digits that only the machine's maths library knows."""
    return [round(float(v), digits) + 0.0 for v in values]


class Scene:
    """A scene under construction. Methods that add something return its index in the file."""

    def __init__(self):
        self.nodes, self.meshes, self.materials, self.cameras, self.lights = [], [], [], [], []
        self.images, self.accessors, self.views = [], [], []
        self.textures, self.data, self.extensions, self.shapes = [], bytearray(), set(), {}
        self.skins, self.samplers, self.channels = [], [], []

    # ---- materials ----

    def material(self, name, colour, metallic, roughness, extensions=None, double_sided=True, **more):
        self.extensions |= set(extensions or {})
        entry = {"name": name, "pbrMetallicRoughness": {"baseColorFactor": rounded([*colour, 1.0]),
                                                        "metallicFactor": metallic, "roughnessFactor": roughness}}
        texture = more.pop("base_texture", None)
        if texture is not None:
            entry["pbrMetallicRoughness"]["baseColorTexture"] = {"index": texture}
        if extensions:
            entry["extensions"] = extensions
        self.materials.append({**entry, "doubleSided": double_sided, **more})
        return len(self.materials) - 1

    def diffuse(self, name, colour, **more):
        return self.material(name, colour, 0.0, 1.0, dict(DIFFUSE), **more)

    def metal(self, name, colour, roughness=0.0):
        return self.material(name, colour, 1.0, roughness)

    def glass(self, name, ior, colour=(1.0, 1.0, 1.0), distance=None):
        """A smooth dielectric around a closed body; light keeps `colour` of itself after `distance`."""
        volume = {"thicknessFactor": 1.0}
        if distance is not None:
            volume |= {"attenuationColor": rounded(colour), "attenuationDistance": distance}
        return self.material(name, (1.0, 1.0, 1.0), 0.0, 0.0, double_sided=False, extensions={
            "KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": ior},
            "KHR_materials_volume": volume})

    def emitter(self, name, radiance):
        strength = max(radiance)
        return self.material(name, (0.0, 0.0, 0.0), 0.0, 1.0, double_sided=False, extensions={
            **DIFFUSE, "KHR_materials_emissive_strength": {"emissiveStrength": strength}},
            emissiveFactor=rounded(r / strength for r in radiance))

    def texture(self, png):
        self.images.append({"bufferView": self.view(png), "mimeType": "image/png"})
        self.textures.append({"source": len(self.images) - 1, "sampler": 0})
        return len(self.textures) - 1

    # ---- things ----

    def add(self, name, mesh, material, matrix=None, uv_scale=None):
        """Places a mesh; texture coordinates are written only with `uv_scale`, repeats along u and v."""
        self.place(name, self.mesh(name, [(mesh, material)], uv_scale), matrix)

    def mesh(self, name, parts, uv_scale=None):
        """Stores a mesh of (shape, material) pairs for `place`. A shape is stored once, however many meshes are made of it."""
        primitives = [{**self.shape(shape, uv_scale), "material": material} for shape, material in parts]
        self.meshes.append({"name": name, "primitives": primitives})
        return len(self.meshes) - 1

    def shape(self, shape, uv_scale):
        key = (id(shape), uv_scale)
        if key not in self.shapes:
            attributes = {"POSITION": self.vectors(shape.positions, bounds=True), "NORMAL": self.vectors(shape.normals)}
            if uv_scale:
                attributes["TEXCOORD_0"] = self.vectors([(u * uv_scale[0], v * uv_scale[1]) for u, v in shape.uvs])
            # The shape is kept beside its accessors, so that no other one can get its id.
            self.shapes[key] = (shape, {"attributes": attributes, "indices": self.indices(shape)})
        return self.shapes[key][1]

    def place(self, name, mesh, matrix=None):
        """Places a mesh that `mesh` stored, any number of times."""
        node = {"name": name, "mesh": mesh}
        if matrix:
            node["matrix"] = rounded(matrix, 9)
        self.nodes.append(node)

    def light(self, name, kind, colour, strength, matrix, **more):
        self.extensions.add("KHR_lights_punctual")
        self.lights.append({"name": name, "type": kind, "color": rounded(colour), "intensity": strength, **more})
        self.nodes.append({"name": name, "matrix": rounded(matrix, 9),
                           "extensions": {"KHR_lights_punctual": {"light": len(self.lights) - 1}}})

    def point(self, name, at, intensity, colour=(1.0, 1.0, 1.0)):
        self.light(name, "point", colour, intensity, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, *at, 1])

    def spot(self, name, at, target, intensity, inner, outer, colour=(1.0, 1.0, 1.0)):
        """Cone angles in degrees from the axis."""
        self.light(name, "spot", colour, intensity, frame(at, target), spot={
            "innerConeAngle": round(math.radians(inner), 6), "outerConeAngle": round(math.radians(outer), 6)})

    def directional(self, name, towards_light, irradiance, colour=(1.0, 1.0, 1.0)):
        self.light(name, "directional", colour, irradiance, frame(towards_light, (0.0, 0.0, 0.0)))

    def camera(self, name, eye, target, yfov, aspect):
        """Full vertical field of view in degrees, width over height."""
        self.cameras.append({"name": name, "type": "perspective", "perspective": {
            "yfov": round(math.radians(yfov), 6), "aspectRatio": aspect, "znear": 0.01}})
        self.nodes.append({"name": name, "camera": len(self.cameras) - 1, "matrix": rounded(frame(eye, target), 9)})

    # ---- motion ----

    def node(self, name, mesh, translation=(0.0, 0.0, 0.0), parent=None, skin=None):
        """A node that can be moved: it has no matrix. With `parent` it is below that node."""
        entry = {"name": name, "translation": rounded(translation)} if skin is None else {"name": name, "skin": skin}
        if mesh is not None:
            entry["mesh"] = mesh
        self.nodes.append(entry)
        if parent is not None:
            self.nodes[parent].setdefault("children", []).append(len(self.nodes) - 1)
        return len(self.nodes) - 1

    def skin(self, mesh, joints, inverse, bound, weights):
        """Binds the vertices of a mesh: four joints and weights each."""
        matrices = self.floats("MAT4", inverse)
        view = self.view(bytes(j for four in bound for j in four), 34962)
        self.accessors.append({"bufferView": view, "componentType": 5121, "count": len(bound), "type": "VEC4"})
        chosen = len(self.accessors) - 1
        shares = self.vectors(weights)
        for primitive in self.meshes[mesh]["primitives"]:
            primitive["attributes"] = primitive["attributes"] | {"JOINTS_0": chosen, "WEIGHTS_0": shares}
        self.skins.append({"joints": joints, "inverseBindMatrices": matrices})
        return len(self.skins) - 1

    def morph(self, mesh, targets):
        """Displacements of all vertices of a mesh of one shape, for each target."""
        targets = [{"POSITION": self.vectors(target, bounds=True)} for target in targets]
        for primitive in self.meshes[mesh]["primitives"]:
            primitive["targets"] = targets
        self.meshes[mesh]["weights"] = [0.0] * len(targets)

    def keys(self, target, times, values, interpolation="LINEAR"):
        """Values at times in seconds: three to a time (in-tangent, value, out-tangent) for `CUBICSPLINE`."""
        kind = "SCALAR" if len(values[0]) == 1 else f"VEC{len(values[0])}"
        sampler = {"input": self.floats("SCALAR", [(t,) for t in times]), "output": self.floats(kind, values)}
        self.accessors[sampler["input"]] |= {"min": [min(times)], "max": [max(times)]}
        self.samplers.append(sampler | ({} if interpolation == "LINEAR" else {"interpolation": interpolation}))
        self.channels.append({"sampler": len(self.samplers) - 1, "target": target})

    def pointer(self, pointer, times, values):
        self.extensions.add("KHR_animation_pointer")
        self.keys({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}, times, values)

    # ---- bytes ----

    def floats(self, kind, rows):
        """Numbers that are no attributes of vertices."""
        flat = rounded(x for row in rows for x in row)
        view = self.view(struct.pack(f"<{len(flat)}f", *flat))
        self.accessors.append({"bufferView": view, "componentType": 5126, "count": len(rows), "type": kind})
        return len(self.accessors) - 1

    def view(self, data, target=None):
        self.data += b"\0" * (-len(self.data) % 4)
        entry = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.views.append(entry | ({"target": target} if target else {}))
        self.data += data
        return len(self.views) - 1

    def vectors(self, rows, bounds=False):
        flat = rounded(x for row in rows for x in row)
        width = len(rows[0])
        data = struct.pack(f"<{len(flat)}f", *flat)
        entry = {"bufferView": self.view(data, 34962), "componentType": 5126, "count": len(rows), "type": f"VEC{width}"}
        if bounds:
            stored = struct.unpack(f"<{len(flat)}f", data)
            entry["min"] = [min(stored[k::width]) for k in range(width)]
            entry["max"] = [max(stored[k::width]) for k in range(width)]
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def indices(self, mesh):
        flat = [i for triangle in mesh.triangles for i in triangle]
        code, kind = ("H", 5123) if len(mesh.positions) < 65535 else ("I", 5125)
        view = self.view(struct.pack(f"<{len(flat)}{code}", *flat), 34963)
        self.accessors.append({"bufferView": view, "componentType": kind, "count": len(flat), "type": "SCALAR"})
        return len(self.accessors) - 1

    def roots(self):
        below = {child for node in self.nodes for child in node.get("children", [])}
        return [i for i in range(len(self.nodes)) if i not in below]

    def document(self):
        document = {"asset": {"version": "2.0", "generator": "nephroid tools/scenes", "copyright": "CC0-1.0"},
                    "scene": 0, "scenes": [{"nodes": self.roots()}]}
        for key, value in (("nodes", self.nodes), ("meshes", self.meshes), ("materials", self.materials),
                           ("cameras", self.cameras), ("images", self.images), ("textures", self.textures),
                           ("skins", self.skins), ("accessors", self.accessors), ("bufferViews", self.views)):
            if value:
                document[key] = value
        if self.textures:
            document["samplers"] = [{"magFilter": 9729, "minFilter": 9729, "wrapS": 10497, "wrapT": 10497}]
        if self.channels:
            document["animations"] = [{"name": "motion", "samplers": self.samplers, "channels": self.channels}]
        if self.lights:
            document["extensions"] = {"KHR_lights_punctual": {"lights": self.lights}}
        if self.extensions:
            document["extensionsUsed"] = sorted(self.extensions)
        document["buffers"] = [{"byteLength": len(self.data)}]
        return document

    def glb(self):
        self.data += b"\0" * (-len(self.data) % 4)
        text = json.dumps(self.document(), separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        head = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(self.data))
        return (head + struct.pack("<I4s", len(text), b"JSON") + text
                + struct.pack("<I4s", len(self.data), b"BIN\0") + bytes(self.data))
