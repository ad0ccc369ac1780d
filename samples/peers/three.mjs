// three.js: the cascades of its own CSM for each case, as lines of JSON.  node three.mjs CASE.json...
import { readFileSync } from 'node:fs';
import { PerspectiveCamera, Scene, Vector3, Matrix4 } from 'three';
import { CSM } from 'three/examples/jsm/csm/CSM.js';

const kinds = { 'default': { mode: 'practical' }, 'logarithmic': { mode: 'logarithmic' } };

for (const path of process.argv.slice(2)) {
  const { camera: view, light, budget } = JSON.parse(readFileSync(path));
  if (view.fov_y === undefined) continue;
  for (const [settings, options] of Object.entries(kinds)) {
    const camera = new PerspectiveCamera(view.fov_y * 180 / Math.PI, view.aspect, view.near, view.far);
    camera.position.set(...view.position);
    camera.up.set(...view.up);
    camera.lookAt(new Vector3(...view.position).add(new Vector3(...view.forward)));
    camera.updateMatrixWorld(true);
    const parent = new Scene();
    const csm = new CSM({ camera, parent, cascades: budget.partitions, maxFar: view.far, shadowMapSize: budget.resolution,
                          lightDirection: new Vector3(...light.direction).normalize(), ...options });
    const solve = () => {
      csm.updateFrustums();
      csm.update();
      parent.updateMatrixWorld(true);
      for (const { shadow } of csm.lights) shadow.needsUpdate = true;
      for (const one of csm.lights) one.shadow.updateMatrices(one);
    };
    const times = [];
    for (let i = 0; i < 200; ++i) {
      const start = process.hrtime.bigint();
      solve();
      times.push(Number(process.hrtime.bigint() - start) / 1e3);
    }
    times.sort((a, b) => a - b);
    // CSMShader.js: linearDepth = z / (shadowFar - cameraNear), compared with the breaks; the last cascade goes on to the end.
    const depthOf = share => share * (view.far - view.near);
    const partitions = csm.lights.map(({ shadow }, i) => ({
      near: i === 0 ? view.near : depthOf(csm.breaks[i - 1]),
      far: i + 1 === csm.lights.length ? view.far : depthOf(csm.breaks[i]),
      world_to_clip: new Matrix4().multiplyMatrices(shadow.camera.projectionMatrix, shadow.camera.matrixWorldInverse).transpose().toArray(),
      size: [budget.resolution, budget.resolution],
    }));
    console.log(JSON.stringify({ system: 'three.js', settings, case: path, partitions, solve_us: times[100] }));
  }
}
