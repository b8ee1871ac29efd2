export {AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, HemisphereLight, DoubleSide, LinearSRGBColorSpace, Mesh,
  MeshLambertMaterial, PerspectiveCamera, Raycaster, Scene, Vector2, Vector3, WebGLRenderer} from 'three';
export {OrbitControls} from 'three/examples/jsm/controls/OrbitControls.js';
