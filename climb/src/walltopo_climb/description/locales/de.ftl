# German sentences about a route; see en.ftl for the variables.

limb = { $limb ->
    [left_hand] Linke Hand
    [right_hand] Rechte Hand
    [left_foot] Linker Fuß
   *[right_foot] Rechter Fuß
}
limb-short = { $limb ->
    [left_hand] Links
    [right_hand] Rechts
    [left_foot] Fuß links
   *[right_foot] Fuß rechts
}
origin = { $origin ->
    [left_hand] von der linken Hand aus
    [right_hand] von der rechten Hand aus
    [left_foot] vom linken Fuß aus
   *[right_foot] vom rechten Fuß aus
}
type = { $type ->
    [jug] Henkel
    [rail] Schiene
    [edge] Kante
    [pocket] Loch
    [pinch] Zange
    [crimp] Leiste
    [sloper] Sloper
    [volume] Volumen
    [foothold] Tritt
   *[unknown] Griff
}
sized = { $size ->
    [small] { $type ->
        [jug] kleiner Henkel
        [rail] kleine Schiene
        [edge] kleine Kante
        [pocket] kleines Loch
        [pinch] kleine Zange
        [crimp] kleine Leiste
        [sloper] kleiner Sloper
        [volume] kleines Volumen
        [foothold] kleiner Tritt
       *[unknown] kleiner Griff
    }
    [large] { $type ->
        [jug] großer Henkel
        [rail] große Schiene
        [edge] große Kante
        [pocket] großes Loch
        [pinch] große Zange
        [crimp] große Leiste
        [sloper] großer Sloper
        [volume] großes Volumen
        [foothold] großer Tritt
       *[unknown] großer Griff
    }
   *[medium] { type }
}
type-on = { $type ->
    [jug] am Henkel
    [rail] an der Schiene
    [edge] an der Kante
    [pocket] am Loch
    [pinch] an der Zange
    [crimp] an der Leiste
    [sloper] am Sloper
    [volume] am Volumen
    [foothold] am Tritt
   *[unknown] am Griff
}
clock = { $clock ->
    [0] gleich daneben
   *[other] { $clock } Uhr
}
distance = { $unit ->
    [hands] { $distance ->
        [one] { $distance } Handbreit
       *[other] { $distance } Handbreit
    }
   *[centimetres] { $distance } Zentimeter
}
apart = { $unit ->
    [hands] { $apart } Handbreit auseinander
   *[centimetres] { $apart } Zentimeter auseinander
}
height = { $height } Meter über dem Boden
wall = { $wall ->
    [slab] eine Platte von { $steepness } Grad
    [overhang] { $steepness } Grad überhängend
   *[vertical] senkrecht
}
hands = { $hands ->
    [one] { $hands } Griff für die Hände
   *[other] { $hands } Griffe für die Hände
}
moves = { $moves ->
    [one] { $moves } Zug mit den Händen
   *[other] { $moves } Züge mit den Händen
}

route = { $name }: { hands }, { moves }, Top { height }, { wall }.
route-short = { $name }: { moves }.
start = Start. { limb }: { type }, { height }.
start-short = Start. { limb-short }: { type }, { height }.
start-full = Start. { limb }: { sized }, { height }.
start_other = { limb }: { type }, { height }, { apart }.
start_other-full = { limb }: { sized }, { height }, { apart }.
start_with_both = Start: beide Hände { type-on }, { height }.
start_foot = { limb }: { type }, { height }.
start_foot-full = { limb }: { sized }, { height }.
steepness = Die Wand ist jetzt { wall }.
hand = { limb }: { clock }, { distance }, { type }.
hand-short = { limb-short }: { clock }, { distance }.
hand_from_other = { limb }: { clock }, { distance } { origin }, { type }.
hand_from_other-short = { limb-short }: { clock }, { distance } { origin }.
hand_from_other-full = { limb }: { clock }, { distance } { origin }, { sized }, { height }.
hand-full = { limb }: { clock }, { distance }, { sized }, { height }.
match = { limb }: zum Griff der anderen Hand.
jump = Sprung! { limb }: { clock }, { distance }, { type }.
jump-short = Sprung! { limb-short }: { clock }, { distance }.
jump_from_other = Sprung! { limb }: { clock }, { distance } { origin }, { type }.
jump_from_other-short = Sprung! { limb-short }: { clock }, { distance } { origin }.
jump_from_other-full = Sprung! { limb }: { clock }, { distance } { origin }, { sized }, { height }.
jump-full = Sprung! { limb }: { clock }, { distance }, { sized }, { height }.
foot = { limb }: { clock }, { distance }, { type }.
foot_from_other = { limb }: { clock }, { distance } { origin }, { type }.
foot_from_other-full = { limb }: { clock }, { distance } { origin }, { sized }, { height }.
foot-full = { limb }: { clock }, { distance }, { sized }, { height }.
foot_off = { limb }: weg von der Wand.
top = Top: { type }, { height }.
top-full = Top: { sized }, { height }.
out_of_reach = Der nächste Griff ist bei dieser Körpergröße außer Reichweite.
