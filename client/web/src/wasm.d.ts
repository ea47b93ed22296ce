declare module 'rilievo.wasm?url' {
  const address: string;
  export default address;
}
