# Doxygen's XML must hold a text for every function that the library exports: nm -C -g libgnomon.a | awk -f documented.awk - xml/*.xml
/ T gnomon::/ { sub(/.* T gnomon::/, ""); sub(/\(.*/, ""); exported[$0] }
/<memberdef kind="function"/ { isFunction = 1 }
/<\/memberdef>/ { isFunction = 0 }
isFunction && /<name>/ { name = $0; gsub(/.*<name>|<.*/, "", name) }
isFunction && /<para>/ { documented[name] }
END {
  for (name in exported) {
    ++count
    if (!(name in documented)) {
      print "docs: no text for gnomon::" name
      bad = 1
    }
  }
  exit bad || !count
}
