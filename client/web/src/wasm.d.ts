declare module 'rilievo.wasm?url' {
  const address: string;
  export default address;
}
declare module '*.dss?url' {
  const address: string;
  export default address;
}
