"""Rebuild `three.min.js`, the 3D library inside every HTML plan, from the npm registry.

`python rebuild.py` needs node and npm. It installs the two packages below, bundles what the viewer uses and nothing
else, and puts the licence of three.js in front; the same versions give the same bytes.
"""

import json
import subprocess
import tempfile
from pathlib import Path

PACKAGES = ("three@0.187.0", "esbuild@0.28.2")
ENTRY = """
export { BufferAttribute, BufferGeometry, Color, DirectionalLight, HemisphereLight, InstancedMesh, Matrix4, Mesh,
  MeshStandardMaterial, NeutralToneMapping, PerspectiveCamera, Quaternion, Scene, ShaderMaterial,
  SphereGeometry, Vector3, WebGLRenderer, WebGLRenderTarget } from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
"""
OPTIONS = ("--bundle", "--minify", "--format=iife", "--global-name=THREE", "--charset=ascii", "--target=es2020")


def main() -> None:
    """Bundle the viewer's libraries into `three.min.js`; needs npm and a network."""
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder)
        (here / "package.json").write_text(json.dumps({"private": True}))
        subprocess.run(["npm", "install", "--no-audit", "--no-fund", "--save-exact", *PACKAGES], cwd=here, check=True)
        (here / "entry.js").write_text(ENTRY)
        subprocess.run(["npx", "esbuild", "entry.js", *OPTIONS, "--outfile=three.min.js"], cwd=here, check=True)
        licence = (here / "node_modules/three/LICENSE").read_text().strip()
        target = Path(__file__).with_name("three.min.js")
        target.write_text(f"/*!\n{PACKAGES[0]}\n\n{licence}\n*/\n{(here / 'three.min.js').read_text()}")
    print(f"{target.name}: {target.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
