declare module "*.css?inline" {
  const text: string;
  export default text;
}

declare module "*?worker&inline" {
  const Inline: new () => Worker;
  export default Inline;
}
