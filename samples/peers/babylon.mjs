// Babylon.js: the cascades of its own CascadedShadowGenerator for each case, as lines of JSON.  node babylon.mjs CASE.json...
import { readFileSync } from 'node:fs';
import { NullEngine } from '@babylonjs/core/Engines/nullEngine.js';
import { Scene } from '@babylonjs/core/scene.js';
import { FreeCamera } from '@babylonjs/core/Cameras/freeCamera.js';
import { DirectionalLight } from '@babylonjs/core/Lights/directionalLight.js';
import { Vector3 } from '@babylonjs/core/Maths/math.vector.js';
import { CascadedShadowGenerator } from '@babylonjs/core/Lights/Shadows/cascadedShadowGenerator.js';
import '@babylonjs/core/Lights/Shadows/shadowGeneratorSceneComponent.js';

const kinds = { 'default': {}, 'lambda 1': { lambda: 1, stabilizeCascades: false } };

const engine = new NullEngine();
engine._features.supportCSM = true;
engine.createDepthStencilTexture = () => null;  // nothing is drawn
for (const path of process.argv.slice(2)) {
  const { camera: view, light, budget } = JSON.parse(readFileSync(path));
  if (view.fov_y === undefined || budget.partitions < 2) continue;  // at least two cascades
  for (const [settings, options] of Object.entries(kinds)) {
    const scene = new Scene(engine);
    scene.useRightHandedSystem = true;
    const camera = new FreeCamera('c', new Vector3(...view.position), scene);
    camera.upVector = new Vector3(...view.up);
    camera.setTarget(new Vector3(...view.position).add(new Vector3(...view.forward)));
    camera.fov = view.fov_y;
    camera.minZ = view.near;
    camera.maxZ = view.far;
    engine.getAspectRatio = () => view.aspect;
    scene.activeCamera = camera;
    const sun = new DirectionalLight('l', new Vector3(...light.direction).normalize(), scene);
    const shadows = new CascadedShadowGenerator(budget.resolution, sun, undefined, camera);
    shadows.numCascades = budget.partitions;
    Object.assign(shadows, options);
    const solve = () => {
      camera.getViewMatrix(true);
      camera.getProjectionMatrix(true);
      scene.updateTransformMatrix(true);
      shadows.splitFrustum();
      shadows._splitFrustum();
      shadows._computeMatrices();
    };
    const times = [];
    for (let i = 0; i < 200; ++i) {
      const start = process.hrtime.bigint();
      solve();
      times.push(Number(process.hrtime.bigint() - start) / 1e3);
    }
    times.sort((a, b) => a - b);
    const ends = shadows._viewSpaceFrustumsZ;
    const partitions = [...Array(budget.partitions).keys()].map(i => ({
      near: i === 0 ? view.near : ends[i - 1],
      far: i + 1 === budget.partitions ? view.far : ends[i],
      world_to_clip: [...shadows.getCascadeTransformMatrix(i).transpose().m],
      size: [budget.resolution, budget.resolution],
    }));
    console.log(JSON.stringify({ system: 'Babylon.js', settings, case: path, partitions, solve_us: times[100] }));
    scene.dispose();
  }
}
