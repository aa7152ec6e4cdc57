import {
  AmbientLight, Box3, Color, DirectionalLight, GridHelper, Group, Line, BufferGeometry, LineBasicMaterial, MOUSE, OrthographicCamera,
  PerspectiveCamera, Plane, Raycaster, Scene, TOUCH, Vector2, Vector3, WebGLRenderer, type Object3D,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { distanceToFit } from "../math/fit";
import type { Vec3 } from "../math/pose";

const quick = 25; // [ms] one or two screen frames; faster drawing needs no pause

/** Whether a graphics card draws; without one, antialiasing is too slow. */
function drawnByCard(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  const names = context?.getExtension("WEBGL_debug_renderer_info");
  const renderer = String(context?.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : context.RENDERER));
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return !/swiftshader|llvmpipe|softpipe|software/i.test(renderer);
}

/** The scene with its two cameras. Draws only after changes, and pauses as long as drawing took. */
export class MapView {
  readonly content = new Group(); // content of the recording
  private readonly scene = new Scene();
  private readonly renderer: WebGLRenderer;
  private readonly eye = new PerspectiveCamera(50, 1, 0.05, 500);
  private readonly above = new OrthographicCamera(-5, 5, 5, -5, -100, 500);
  private readonly eyeControls: OrbitControls;
  private readonly aboveControls: OrbitControls;
  private top = false;
  private waiting = false;
  private fence: WebGLSync | null = null; // of the frame being drawn
  private begun = 0;
  private rest = 0; // no drawing before this time
  private readonly afterDraw: (() => void)[] = [];
  private followed: Vector3 | undefined;
  private placed = false; // the user moved the view; kept until another scene is framed
  private measuring: ((words: string) => void) | undefined;
  private readonly ends: Vector3[] = [];
  private readonly tape = new Line(new BufferGeometry(), new LineBasicMaterial({ color: 0xcc79a7, depthTest: false }));

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: drawnByCard(), preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    const grid = new GridHelper(40, 40, 0x7b8594, 0x7b8594);
    grid.rotation.x = Math.PI / 2; // into the plane of the floor
    for (const material of [grid.material].flat()) Object.assign(material, { transparent: true, opacity: 0.25 });
    const sun = new DirectionalLight(0xffffff, 1.5);
    sun.position.set(3, 2, 8);
    this.scene.add(grid, new AmbientLight(0xffffff, 1.5), sun, this.content, this.tape);
    for (const camera of [this.eye, this.above]) camera.up.set(0, 0, 1);
    this.above.up.set(0, 1, 0);
    this.eyeControls = this.controls(this.eye);
    this.aboveControls = this.controls(this.above);
    this.aboveControls.enableRotate = false;
    this.aboveControls.maxPolarAngle = Math.PI;
    this.aboveControls.mouseButtons.LEFT = MOUSE.PAN;
    this.aboveControls.touches.ONE = TOUCH.PAN;
    this.showTop(false);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    canvas.addEventListener("click", (event) => this.clicked(event));
  }

  private controls(camera: PerspectiveCamera | OrthographicCamera): OrbitControls {
    const controls = new OrbitControls(camera, this.canvas);
    controls.addEventListener("change", () => this.draw());
    controls.addEventListener("start", () => { this.placed = true; });
    controls.maxPolarAngle = Math.PI * 0.49; // stay above the floor
    return controls;
  }

  setBackground(color: string): void {
    this.scene.background = new Color(color);
    this.draw();
  }

  showTop(top: boolean): void {
    this.top = top;
    this.eyeControls.enabled = !top;
    this.aboveControls.enabled = top;
    this.draw();
  }

  /** Both cameras show the whole content, at any aspect of the canvas. */
  frame(): void {
    this.placed = false;
    this.fit();
  }

  /** Fits the view again if content lies outside it, unless the user moved the view. */
  refit(): void {
    if (!this.placed && !this.cornersOf(new Box3().setFromObject(this.content)).every((corner) => this.shows(corner))) this.fit();
  }

  private fit(): void {
    const box = new Box3().setFromObject(this.content);
    if (box.isEmpty()) return;
    const corners = this.cornersOf(box), margin = 1.06;
    const target = this.followed?.clone() ?? box.getCenter(new Vector3()).setZ(0);
    this.eyeControls.target.copy(target);
    this.aboveControls.target.copy(target);
    const forward = new Vector3(0.1, 0.75, -0.65).normalize();
    const right = forward.clone().cross(this.eye.up).normalize(), up = right.clone().cross(forward);
    const tuple = (v: Vector3): Vec3 => [v.x, v.y, v.z];
    const distance = distanceToFit(corners.map(tuple), tuple(target), { right: tuple(right), up: tuple(up), forward: tuple(forward) },
      Math.tan((this.eye.fov * Math.PI) / 360), this.eye.aspect);
    this.eye.position.copy(target).addScaledVector(forward, -Math.max(1.5, distance * margin));
    this.above.position.set(target.x, target.y, 50);
    const half = (across: (v: Vector3) => number, shown: number): number => Math.max(0.5, ...corners.map((v) => Math.abs(across(v)))) / shown;
    this.above.zoom = 1 / (margin * Math.max(half((v) => v.x - target.x, this.above.right), half((v) => v.y - target.y, this.above.top)));
    this.above.updateProjectionMatrix();
    this.eyeControls.update();
    this.aboveControls.update();
    this.draw();
  }

  private cornersOf(box: Box3): Vector3[] {
    const { min, max } = box;
    return [min.x, max.x].flatMap((x) => [min.y, max.y].flatMap((y) => [min.z, max.z].map((z) => new Vector3(x, y, z))));
  }
  private shows(corner: Vector3): boolean {
    this.camera.updateMatrixWorld();
    const { x, y, z } = corner.clone().project(this.camera);
    return Math.abs(x) <= 1 && Math.abs(y) <= 1 && Math.abs(z) <= 1;
  }

  /** Moves the cameras with this point, keeping their direction; undefined ends it. */
  follow(x: number | undefined, y = 0): void {
    if (x === undefined) { this.followed = undefined; return; }
    const now = new Vector3(x, y, 0);
    const moved = now.clone().sub(this.followed ?? this.eyeControls.target.clone().setZ(0));
    for (const controls of [this.eyeControls, this.aboveControls]) {
      const step = this.followed ? moved : now.clone().sub(controls.target).setZ(0);
      controls.target.add(step);
      controls.object.position.add(step);
      controls.update();
    }
    this.followed = now;
    this.draw();
  }

  /** Measures the distance of two clicks on the floor and passes it as text; undefined ends measuring. */
  measure(show: ((words: string) => void) | undefined): void {
    this.measuring = show;
    this.ends.length = 0;
    this.tape.visible = false;
    this.draw();
  }

  private clicked(event: MouseEvent): void {
    if (!this.measuring) return;
    const bounds = this.canvas.getBoundingClientRect();
    const at = new Vector2(((event.clientX - bounds.left) / bounds.width) * 2 - 1, 1 - ((event.clientY - bounds.top) / bounds.height) * 2);
    const caster = new Raycaster();
    caster.setFromCamera(at, this.camera);
    const floor = caster.ray.intersectPlane(new Plane(new Vector3(0, 0, 1), 0), new Vector3());
    if (!floor) return;
    if (this.ends.length === 2) this.ends.length = 0;
    this.ends.push(floor);
    const [a, b] = this.ends;
    this.tape.visible = true;
    this.tape.geometry.dispose();
    this.tape.geometry = new BufferGeometry().setFromPoints(this.ends);
    this.measuring(a && b ? `${a.distanceTo(b).toFixed(3)} m` : `from (${floor.x.toFixed(2)}, ${floor.y.toFixed(2)}) m`);
    this.draw();
  }

  /** Position of a point of the map on the canvas [CSS px]; for tests and labels. */
  pixelOf(x: number, y: number, z: number): [number, number] {
    const v = new Vector3(x, y, z).project(this.camera);
    return [((v.x + 1) / 2) * this.canvas.clientWidth, ((1 - v.y) / 2) * this.canvas.clientHeight];
  }

  clear(): void {
    disposeOf(this.content);
  }

  private get camera(): PerspectiveCamera | OrthographicCamera {
    return this.top ? this.above : this.eye;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement!;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.eye.aspect = width / height;
    const narrow = Math.min(width, height);
    Object.assign(this.above, { left: -5 * (width / narrow), right: 5 * (width / narrow), top: 5 * (height / narrow), bottom: -5 * (height / narrow) });
    this.eye.updateProjectionMatrix();
    this.above.updateProjectionMatrix();
    if (!this.placed) this.fit();
    this.draw();
  }

  /** Schedules a frame; several changes share one. */
  draw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(this.render);
  }
  /** Draws the current state once more; for tests. */
  drawn(): Promise<void> {
    this.draw();
    return new Promise((done) => this.afterDraw.push(done));
  }

  private readonly render = (): void => {
    if (this.busy()) { requestAnimationFrame(this.render); return; }
    this.waiting = false;
    this.begun = performance.now();
    this.renderer.render(this.scene, this.camera);
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    this.afterDraw.splice(0).forEach((done) => done());
  };

  /** A slow frame would delay the camera image and the buttons if the next one followed at once. */
  private busy(): boolean {
    const gl = this.renderer.getContext() as WebGL2RenderingContext, now = performance.now();
    if (this.fence && !gl.isContextLost()) {
      if (gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED) return true;
      gl.deleteSync(this.fence);
      const took = now - this.begun;
      this.rest = took > quick ? now + took : 0;
    }
    this.fence = null;
    return now < this.rest;
  }
}

/** Empties a group and frees its memory on the graphics card. */
export function disposeOf(group: Group): void {
  const geometries: { dispose(): void }[] = [];
  group.traverse((object: Object3D & { geometry?: { dispose(): void } }) => object.geometry && geometries.push(object.geometry));
  geometries.forEach((geometry) => geometry.dispose());
  group.clear();
}
