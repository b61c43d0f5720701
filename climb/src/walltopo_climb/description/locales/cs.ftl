# Czech sentences about a route; see en.ftl for the variables.

limb = { $limb ->
    [left_hand] Levá ruka
    [right_hand] Pravá ruka
    [left_foot] Levá noha
   *[right_foot] Pravá noha
}
limb-short = { $limb ->
    [left_hand] Levá
    [right_hand] Pravá
    [left_foot] Levá noha
   *[right_foot] Pravá noha
}
origin = { $origin ->
    [left_hand] od levé ruky
    [right_hand] od pravé ruky
    [left_foot] od levé nohy
   *[right_foot] od pravé nohy
}
type = { $type ->
    [jug] madlo
    [rail] kolejnice
    [edge] hrana
    [pocket] dírka
    [pinch] stisk
    [crimp] lišta
    [sloper] oblina
    [volume] volume
    [foothold] stup
   *[unknown] chyt
}
sized = { $size ->
    [small] { $type ->
        [jug] malé madlo
        [rail] malá kolejnice
        [edge] malá hrana
        [pocket] malá dírka
        [pinch] malý stisk
        [crimp] malá lišta
        [sloper] malá oblina
        [volume] malé volume
        [foothold] malý stup
       *[unknown] malý chyt
    }
    [large] { $type ->
        [jug] velké madlo
        [rail] velká kolejnice
        [edge] velká hrana
        [pocket] velká dírka
        [pinch] velký stisk
        [crimp] velká lišta
        [sloper] velká oblina
        [volume] velké volume
        [foothold] velký stup
       *[unknown] velký chyt
    }
   *[medium] { type }
}
type-on = { $type ->
    [jug] na madle
    [rail] na kolejnici
    [edge] na hraně
    [pocket] v dírce
    [pinch] na stisku
    [crimp] na liště
    [sloper] na oblině
    [volume] na volume
    [foothold] na stupu
   *[unknown] na chytu
}
clock = { $clock ->
    [0] hned vedle
    [1] na jedné hodině
    [2] na dvou hodinách
    [3] na třech hodinách
    [4] na čtyřech hodinách
    [5] na pěti hodinách
    [6] na šesti hodinách
    [7] na sedmi hodinách
    [8] na osmi hodinách
    [9] na devíti hodinách
    [10] na deseti hodinách
    [11] na jedenácti hodinách
   *[12] na dvanácti hodinách
}
distance = { $unit ->
    [hands] { $distance ->
        [one] { $distance } šířka dlaně
        [few] { $distance } šířky dlaně
        [many] { $distance } šířky dlaně
       *[other] { $distance } šířek dlaně
    }
   *[centimetres] { $distance ->
        [one] { $distance } centimetr
        [few] { $distance } centimetry
        [many] { $distance } centimetru
       *[other] { $distance } centimetrů
    }
}
apart = { $unit ->
    [hands] { $apart ->
        [one] { $apart } šířku dlaně od sebe
        [few] { $apart } šířky dlaně od sebe
        [many] { $apart } šířky dlaně od sebe
       *[other] { $apart } šířek dlaně od sebe
    }
   *[centimetres] { $apart ->
        [one] { $apart } centimetr od sebe
        [few] { $apart } centimetry od sebe
        [many] { $apart } centimetru od sebe
       *[other] { $apart } centimetrů od sebe
    }
}
height = { $height ->
    [one] { $height } metr nad zemí
    [few] { $height } metry nad zemí
    [many] { $height } metru nad zemí
   *[other] { $height } metrů nad zemí
}
wall = { $wall ->
    [slab] { $steepness ->
        [one] položená o { $steepness } stupeň
        [few] položená o { $steepness } stupně
        [many] položená o { $steepness } stupně
       *[other] položená o { $steepness } stupňů
    }
    [overhang] { $steepness ->
        [one] převislá o { $steepness } stupeň
        [few] převislá o { $steepness } stupně
        [many] převislá o { $steepness } stupně
       *[other] převislá o { $steepness } stupňů
    }
   *[vertical] kolmá
}
hands = { $hands ->
    [one] { $hands } chyt pro ruce
    [few] { $hands } chyty pro ruce
    [many] { $hands } chytu pro ruce
   *[other] { $hands } chytů pro ruce
}
moves = { $moves ->
    [one] { $moves } krok rukama
    [few] { $moves } kroky rukama
    [many] { $moves } kroku rukama
   *[other] { $moves } kroků rukama
}

route = { $name }: { hands }, { moves }, top { height }, stěna { wall }.
route-short = { $name }: { moves }.
start = Start. { limb }: { type }, { height }.
start-short = Start. { limb-short }: { type }, { height }.
start-full = Start. { limb }: { sized }, { height }.
start_other = { limb }: { type }, { height }, { apart }.
start_other-full = { limb }: { sized }, { height }, { apart }.
start_with_both = Start: obě ruce { type-on }, { height }.
start_foot = { limb }: { type }, { height }.
start_foot-full = { limb }: { sized }, { height }.
steepness = Stěna je teď { wall }.
hand = { limb }: { clock }, { distance }, { type }.
hand-short = { limb-short }: { clock }, { distance }.
hand_from_other = { limb }: { clock }, { distance } { origin }, { type }.
hand_from_other-short = { limb-short }: { clock }, { distance } { origin }.
hand_from_other-full = { limb }: { clock }, { distance } { origin }, { sized }, { height }.
hand-full = { limb }: { clock }, { distance }, { sized }, { height }.
match = { limb }: na chyt druhé ruky.
jump = Skok! { limb }: { clock }, { distance }, { type }.
jump-short = Skok! { limb-short }: { clock }, { distance }.
jump_from_other = Skok! { limb }: { clock }, { distance } { origin }, { type }.
jump_from_other-short = Skok! { limb-short }: { clock }, { distance } { origin }.
jump_from_other-full = Skok! { limb }: { clock }, { distance } { origin }, { sized }, { height }.
jump-full = Skok! { limb }: { clock }, { distance }, { sized }, { height }.
foot = { limb }: { clock }, { distance }, { type }.
foot_from_other = { limb }: { clock }, { distance } { origin }, { type }.
foot_from_other-full = { limb }: { clock }, { distance } { origin }, { sized }, { height }.
foot-full = { limb }: { clock }, { distance }, { sized }, { height }.
foot_off = { limb }: mimo stěnu.
top = Top: { type }, { height }.
top-full = Top: { sized }, { height }.
out_of_reach = Další chyt je při této výšce postavy mimo dosah.
