/** What the part and the probe are drawn with: outlines, symbols, pictures on faces, the probe itself. */

import {
  BoxGeometry, BufferGeometry, CanvasTexture, EdgesGeometry, Float32BufferAttribute, Group, InstancedMesh,
  LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, SRGBColorSpace,
} from "three";
import type { FacePicture, FaceShape, Matrix, ObjectShape, Sensor } from "./types";

/** A picture on the triangles of a face. */
export function pictureMesh(picture: FacePicture, face: FaceShape): Mesh {
  const { canvas, x0, x1, y0, y1 } = picture, geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(face.corners, 3));
  geometry.setAttribute("uv", new Float32BufferAttribute(
    face.places.map((mm, i) => (i % 2 ? (mm - y0) / (y1 - y0) : (mm - x0) / (x1 - x0))), 2));
  const map = new CanvasTexture(canvas);
  map.colorSpace = SRGBColorSpace;
  return new Mesh(geometry, new MeshBasicMaterial({ map, transparent: true, alphaTest: 0.02, depthWrite: false }));
}

export function matrixOf(rows: Matrix): Matrix4 {
  return new Matrix4().fromArray(rows.flat()).transpose();
}

export function outlinesOf(shape: ObjectShape): BufferGeometry {
  const corners: number[] = [];
  for (const face of shape.faces) {
    for (const line of face.outlines) line.forEach((a, i) => {
      if (i + 1 < line.length || !face.round) corners.push(...a, ...line[(i + 1) % line.length]!);
    });
  }
  return new BufferGeometry().setAttribute("position", new Float32BufferAttribute(corners, 3));
}

/** One mesh per label, an instance per symbol. */
export function symbolsOf(shape: ObjectShape): { mesh: InstancedMesh; faces: Uint16Array }[] {
  return shape.glyphs.flatMap((corners, label) => {
    const places: Matrix4[] = [], faces: number[] = [];
    shape.faces.forEach((face, number) => {
      face.labels.forEach((one, i) => {
        if (one !== label) return;
        places.push(new Matrix4().fromArray([...face.stands[i]!, 0, 0, 0, 1]).transpose());
        faces.push(number);
      });
    });
    if (!places.length) return [];
    const geometry = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(corners, 3));
    geometry.computeVertexNormals();
    const mesh = new InstancedMesh(geometry, new MeshLambertMaterial(), places.length);
    places.forEach((place, i) => mesh.setMatrixAt(i, place));
    return [{ mesh, faces: Uint16Array.from(faces) }];
  });
}

/** The probe in the sensor frame: overlay, board, and a dot at the upper left tactel. */
export function probeOf(sensor: Sensor): Group {
  const wide = sensor.columns * sensor.pitch_mm, high = sensor.rows * sensor.row_pitch_mm, group = new Group();
  const box = (w: number, h: number, from: number, to: number, colour: number, opacity: number): void => {
    const geometry = new BoxGeometry(w, h, to - from).translate(0, 0, (from + to) / 2);
    const material = new MeshLambertMaterial({ color: colour, transparent: opacity < 1, opacity, depthWrite: opacity === 1 });
    group.add(new Mesh(geometry, material));
    const line = new LineBasicMaterial({ color: 0x0f6c8c });
    group.add(new LineSegments(new EdgesGeometry(geometry), line));
  };
  box(wide, high, 0, sensor.overlay_mm, 0x2a9d8f, 0.35);
  box(wide + 5, high + 5, sensor.overlay_mm, sensor.overlay_mm + 3, 0x0f6c8c, 0.45);
  const dot = new Mesh(new BoxGeometry(2.4, 2.4, 1), new MeshLambertMaterial({ color: 0xffffff }));
  dot.position.set(-wide / 2 + 1.5, high / 2 - 1.5, sensor.overlay_mm + 3.3);
  group.add(dot);
  group.matrixAutoUpdate = false;
  return group;
}
