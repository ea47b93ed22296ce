// The picture: a surface, the edges of its control mesh and the scan, turned by hand. Drawn when
// something has changed, and only then.
import {
  BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, HemisphereLight, LineBasicMaterial,
  LineSegments, Mesh, MeshStandardMaterial, PerspectiveCamera, Points, PointsMaterial, Scene, Spherical,
  Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import type { ControlPicture, Picture } from '../decoder/messages';

const TURN = Math.PI / 24;
const UP = new Vector3(0, 0, 1);
/** The ground behind the lines and points. */
const DARK = matchMedia('(prefers-color-scheme: dark)').matches;

function geometryOf(positions: Float32Array): BufferGeometry {
  return new BufferGeometry().setAttribute('position', new BufferAttribute(positions, 3));
}

export class Viewer {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(35, 1, 0.002, 50);
  readonly #controls: OrbitControls;
  readonly #surface: Mesh<BufferGeometry, MeshStandardMaterial>;
  readonly #edges: LineSegments<BufferGeometry, LineBasicMaterial>;
  readonly #creases: LineSegments<BufferGeometry, LineBasicMaterial>;
  readonly #points: Points<BufferGeometry, PointsMaterial>;
  #asked = 0;
  #warm = false;

  /** Throws where the browser has no WebGL. */
  constructor(canvas: HTMLCanvasElement) {
    this.#renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.#camera.up.copy(UP);
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.addEventListener('change', () => this.draw());
    this.#surface = new Mesh(new BufferGeometry(), new MeshStandardMaterial({
      vertexColors: true, side: DoubleSide, roughness: 0.85, metalness: 0,
      // The lines of the control mesh and the points lie over it, also those a little below.
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 10,
    }));
    this.#edges = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: new Color(DARK ? '#b9cad4' : '#2f4858'), transparent: true, opacity: 0.75 }));
    this.#creases = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: new Color(DARK ? '#ff9a78' : '#b4472f') }));
    this.#points = new Points(new BufferGeometry(), new PointsMaterial({ color: new Color(DARK ? '#7cc4de' : '#1d6f8a'), size: 1.6, sizeAttenuation: false }));
    const light = new DirectionalLight(0xffffff, 2.1);
    light.position.set(-0.6, 0.9, 0.8);
    this.#camera.add(light);
    this.#scene.add(this.#camera, new HemisphereLight(0xffffff, 0x8a8378, 1.25), this.#surface, this.#edges, this.#creases, this.#points);
    new ResizeObserver(() => this.#resize()).observe(canvas.parentElement!);
    this.resetView();
  }

  /**
   * Draws one of each, of the kinds of buffers that will come, and wipes it out before it is seen: a
   * graphics driver, the software one above all, makes its programs when they are first drawn with,
   * and the first layer of a surface does not wait for that.
   */
  #warmUp(): void {
    const some = new Float32Array([-0.3, -0.3, 0, 0.3, -0.3, 0, 0, 0.3, 0.3]);
    const corners = new BufferAttribute(new Uint32Array([0, 1, 2]), 1);
    const parts = [this.#surface, this.#edges, this.#creases, this.#points];
    for (const part of parts) {
      part.geometry = geometryOf(some);
      part.frustumCulled = false;
      part.visible = true;
    }
    for (const name of ['normal', 'color']) this.#surface.geometry.setAttribute(name, new BufferAttribute(some.slice(), 3));
    for (const part of [this.#surface, this.#edges, this.#creases]) part.geometry.setIndex(corners);
    this.#renderer.render(this.#scene, this.#camera);
    for (const part of parts) part.visible = false;
    this.#warm = true;
  }

  showSurface(picture: Picture, colours: Float32Array): void {
    this.#surface.geometry.dispose();
    this.#surface.geometry = geometryOf(picture.positions)
      .setAttribute('normal', new BufferAttribute(picture.normals, 3))
      .setAttribute('color', new BufferAttribute(colours, 3))
      .setIndex(new BufferAttribute(picture.faces, 1));
    this.#surface.visible = true;
    this.draw();
  }

  colourSurface(colours: Float32Array): void {
    this.#surface.geometry.setAttribute('color', new BufferAttribute(colours, 3));
    this.draw();
  }

  showControl(control: ControlPicture): void {
    const positions = new BufferAttribute(control.positions, 3);
    for (const [lines, numbers] of [[this.#edges, control.edges], [this.#creases, control.creases]] as const) {
      lines.geometry.dispose();
      lines.geometry = new BufferGeometry().setAttribute('position', positions).setIndex(new BufferAttribute(numbers, 1));
    }
  }

  showScan(positions: Float32Array): void {
    this.#points.geometry.dispose();
    this.#points.geometry = geometryOf(positions);
    if (this.#points.visible) this.draw();
  }

  setVisible(parts: { control?: boolean; scan?: boolean; surface?: boolean }): void {
    if (parts.control !== undefined) this.#edges.visible = this.#creases.visible = parts.control;
    if (parts.scan !== undefined) this.#points.visible = parts.scan;
    if (parts.surface !== undefined) this.#surface.visible = parts.surface;
    this.draw();
  }

  /** Angles to the right and upwards, in steps. */
  turn(right: number, up: number): void {
    const offset = this.#camera.position.clone().sub(this.#controls.target);
    // Spherical angles are about y, the camera's are about z.
    const angles = new Spherical().setFromCartesianCoords(offset.x, offset.z, -offset.y);
    angles.theta += right * TURN;
    angles.phi = Math.min(Math.max(angles.phi - up * TURN, 0.01), Math.PI - 0.01);
    const turned = new Vector3().setFromSpherical(angles);
    this.#camera.position.copy(this.#controls.target).add(new Vector3(turned.x, -turned.z, turned.y));
    this.#controls.update();
    this.draw();
  }

  zoom(factor: number): void {
    const offset = this.#camera.position.clone().sub(this.#controls.target);
    offset.setLength(Math.min(Math.max(offset.length() * factor, 0.05), 20));
    this.#camera.position.copy(this.#controls.target).add(offset);
    this.#controls.update();
    this.draw();
  }

  resetView(): void {
    this.#controls.target.set(0, 0, 0);
    // The unit box has a diagonal of 1; a narrow picture needs more room.
    const distance = 1.55 / Math.min(1, this.#camera.aspect || 1) ** 0.85;
    this.#camera.position.set(0.62, -0.68, 0.4).setLength(distance);
    this.#controls.update();
    this.draw();
  }

  /** With the next frame; many asks are one picture. */
  draw(): void {
    if (this.#asked !== 0) return;
    this.#asked = requestAnimationFrame(() => this.drawNow());
  }

  drawNow(): void {
    cancelAnimationFrame(this.#asked);
    this.#asked = 0;
    this.#renderer.render(this.#scene, this.#camera);
  }

  #resize(): void {
    const { clientWidth, clientHeight } = this.#renderer.domElement.parentElement!;
    if (clientWidth === 0 || clientHeight === 0) return;
    const before = this.#camera.aspect;
    this.#renderer.setSize(clientWidth, clientHeight, false);
    this.#camera.aspect = clientWidth / clientHeight;
    this.#camera.updateProjectionMatrix();
    if (Math.min(before, 1) !== Math.min(this.#camera.aspect, 1)) this.resetView();
    if (!this.#warm) this.#warmUp(); // at the size that the pictures will have
    this.drawNow();
  }
}
